// SPDX-License-Identifier: GPL-2.0-only
// An engine that forwards all calls to another engine. Tests derive classes from it that count or
// refuse calls.

#pragma once

#include "rve/engine/engine.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace rve_test {

class ForwardingEngine : public rve::Engine {
 public:
  explicit ForwardingEngine(std::unique_ptr<rve::Engine> engine_in) : engine(std::move(engine_in))
  {
  }
  const rve::ContactModel &contacts() const override { return engine->contacts(); }
  int add(const rve::RveState &state) override { return engine->add(state); }
  void remove(int rve) override { engine->remove(rve); }
  int size() const override { return engine->size(); }
  rve::RveState state(int rve) const override { return engine->state(rve); }
  void set_material(int rve, const rve::Material &material) override
  {
    engine->set_material(rve, material);
  }
  void turn(const std::vector<int> &rves, const std::vector<rve::Tensor2> &rotations) override
  {
    engine->turn(rves, rotations);
  }
  void advance(const std::vector<int> &rves, const std::vector<rve::Drive> &drives,
               std::vector<rve::Result> &results) override
  {
    engine->advance(rves, drives, results);
  }
  void advance(const std::vector<int> &rves, const std::vector<rve::Drive> &drives,
               std::vector<rve::ElasticResult> &results) override
  {
    engine->advance(rves, drives, results);
  }
  void advance(const std::vector<int> &rves, const std::vector<rve::Drive> &drives,
               std::vector<rve::Response> &responses) override
  {
    engine->advance(rves, drives, responses);
  }
  rve::Request *begin(const std::vector<int> &rves, rve::IncrementCallOf<2> &call) override
  {
    return engine->begin(rves, call);
  }
  void bound_time_steps(const std::vector<int> &rves, double enough,
                        std::vector<double> &bounds) override
  {
    engine->bound_time_steps(rves, enough, bounds);
  }
  std::string description() const override { return engine->description(); }
  std::size_t bytes_per_rve(int num_grains) const override
  {
    return engine->bytes_per_rve(num_grains);
  }
  std::size_t bytes_of_call(int num_rves, int num_grains) override
  {
    return engine->bytes_of_call(num_rves, num_grains);
  }
  rve::Memory memory() const override { return engine->memory(); }

 protected:
  const std::unique_ptr<rve::Engine> engine;
};

}    // namespace rve_test
