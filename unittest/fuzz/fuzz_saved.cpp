// SPDX-License-Identifier: GPL-2.0-only
// Bytes of rve_save. Damaged bytes must be refused and change nothing. Damaged bytes with corrected
// checksums must be restored or refused.

#include "capi/librve.h"
#include "engine/test_states.h"
#include "fuzz_target.h"
#include "rve/core/checksum.h"
#include "rve/engine/packing_io.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <cstdio>
#include <cstring>
#include <memory>
#include <unistd.h>

namespace {

using Packing = std::unique_ptr<rve_packing, void (*)(rve_packing *)>;
using Batch = std::unique_ptr<rve_batch, void (*)(rve_batch *)>;

// Byte positions in saved RVEs. The header has magic, dimension, number of RVEs, size and checksum.
// After the header, each RVE has the size of its record and then the record.
constexpr std::size_t PLACE_OF_SIZE = 24, PLACE_OF_CHECKSUM = 32, HEADER = 40;
// Byte positions in a record: magic, version and number of grains, size, checksum.
constexpr std::size_t RECORD_SIZE = 16, RECORD_CHECKSUM = 24, RECORD_HEADER = 32;

std::uint64_t word_at(const std::string &bytes, std::size_t place)
{
  std::uint64_t word;
  std::memcpy(&word, &bytes[place], sizeof(word));
  return word;
}

void put_word(std::string &bytes, std::size_t place, std::uint64_t word)
{
  std::memcpy(&bytes[place], &word, sizeof(word));
}

/// Returns the bytes with correct sizes and checksums of records and header. In version 1, the
/// checksum of the header covers only the records; later it covers the header as well.
std::string sealed(std::string bytes)
{
  if (bytes.size() < HEADER) return bytes;
  for (std::size_t place = HEADER; bytes.size() - place >= 8 + RECORD_HEADER;) {
    const std::uint64_t length = word_at(bytes, place);
    place += 8;
    if (length < RECORD_HEADER || length > bytes.size() - place) break;
    put_word(bytes, place + RECORD_SIZE, length);
    put_word(bytes, place + RECORD_CHECKSUM,
             rve::checksum_of(&bytes[place + RECORD_HEADER], length - RECORD_HEADER));
    place += length;
  }
  put_word(bytes, PLACE_OF_SIZE, bytes.size());
  put_word(bytes, PLACE_OF_CHECKSUM, 0);
  const std::size_t begin = bytes[7] == '1' ? HEADER : 0;
  put_word(bytes, PLACE_OF_CHECKSUM, rve::checksum_of(&bytes[begin], bytes.size() - begin));
  return bytes;
}

template <class Owner>
std::string saved(const Owner *owner, int (*save)(Owner *, void *, std::size_t, std::size_t *))
{
  std::size_t size = 0;
  std::string bytes;
  if (save(const_cast<Owner *>(owner), nullptr, 0, &size) != RVE_SUCCESS) fuzz::fail(rve_error());
  bytes.resize(size);
  if (save(const_cast<Owner *>(owner), &bytes[0], size, &size) != RVE_SUCCESS)
    fuzz::fail(rve_error());
  return bytes;
}

int save_packing(rve_packing *packing, void *bytes, std::size_t capacity, std::size_t *size)
{
  return rve_packing_save(packing, bytes, capacity, size);
}

template <int D> Packing packing_of(const rve::RveStateOf<D> &state)
{
  const std::string file = "fuzz_saved." + std::to_string(::getpid()) + ".rve";
  rve::write_packing(file, state);
  rve_packing *packing = nullptr;
  if (rve_packing_read(file.c_str(), &packing) != RVE_SUCCESS) fuzz::fail(rve_error());
  std::remove(file.c_str());
  return {packing, rve_packing_free};
}

Batch batch_of(const rve_packing *packing, std::size_t count)
{
  const std::vector<const rve_packing *> packings(count, packing);
  rve_batch *batch = nullptr;
  if (rve_batch_create(packings.data(), count, "format double device cpu threads 1", &batch) !=
      RVE_SUCCESS)
    fuzz::fail(rve_error());
  return {batch, rve_batch_free};
}

/// A batch and its bytes from rve_save in its initial state.
struct Kept {
  Packing packing;
  Batch batch;
  std::string bytes;

  Kept(Packing packing_in, std::size_t count) :
      packing(std::move(packing_in)), batch(batch_of(packing.get(), count)),
      bytes(saved(batch.get(), rve_save))
  {
  }
};

std::vector<Kept> &all_kept()
{
  static std::vector<Kept> all = [] {
    std::vector<Kept> kept;
    kept.emplace_back(packing_of(rve_test::two_disks(1e-4)), 1);
    kept.emplace_back(packing_of(rve_test::crowded_state(5, 1)), 2);
    kept.emplace_back(
        packing_of(rve_test::triangular_packing(rve_test::paper_material(), 4, 4, 0.0037, 1)), 2);
    kept.emplace_back(packing_of(rve_test::disordered_spheres(rve_test::spheres_material(), 2, 1)),
                      1);
    return kept;
  }();
  return all;
}

void treat(const std::string &bytes)
{
  rve_packing *restored = nullptr;
  if (rve_packing_restore(bytes.data(), bytes.size(), &restored) == RVE_SUCCESS) {
    const Packing owner(restored, rve_packing_free);
    std::size_t rows = 0;
    rve_packing_contacts(restored, &rows);
    const std::string again = saved(restored, save_packing);
    rve_packing *twice = nullptr;
    if (rve_packing_restore(again.data(), again.size(), &twice) != RVE_SUCCESS)
      fuzz::fail("a packing that was restored and saved cannot be restored again");
    rve_packing_free(twice);
  } else if (restored) {
    fuzz::fail("bytes that are refused give a packing");
  }
  for (Kept &kept : all_kept()) {
    if (rve_restore(kept.batch.get(), bytes.data(), bytes.size()) != RVE_SUCCESS) {
      if (saved(kept.batch.get(), rve_save) != kept.bytes)
        fuzz::fail("bytes that are refused have changed a batch");
      continue;
    }
    saved(kept.batch.get(), rve_save);
    if (rve_restore(kept.batch.get(), kept.bytes.data(), kept.bytes.size()) != RVE_SUCCESS)
      fuzz::fail(rve_error());
  }
}

}    // namespace

std::vector<std::string> fuzz::seeds()
{
  std::vector<std::string> inputs;
  for (const Kept &kept : all_kept()) {
    inputs.push_back(kept.bytes);
    std::string first_version = kept.bytes;
    first_version[7] = '1';
    inputs.push_back(sealed(first_version));
  }
  return inputs;
}

std::string fuzz::changed(const std::string &input, Mutator &mutator)
{
  // Half of the changes affect only the header and the length of the first record.
  if (mutator.once_in(2)) return mutator.bytes(input);
  return mutator.bytes(input.substr(0, HEADER + 8)) +
      input.substr(std::min(input.size(), HEADER + 8));
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
  const std::string bytes(reinterpret_cast<const char *>(data), size);
  treat(bytes);
  treat(sealed(bytes));
  return 0;
}
