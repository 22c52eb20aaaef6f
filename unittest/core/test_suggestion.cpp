// SPDX-License-Identifier: GPL-2.0-only
// Suggestions for misspelt words.

#include "rve/core/suggestion.h"

#include <gtest/gtest.h>

using rve::did_you_mean;
using rve::edit_distance;
using rve::nearest_words;
using rve::Words;

TEST(EditDistance, CountsInsertedDeletedReplacedAndSwappedLetters)
{
  EXPECT_EQ(edit_distance("friction", "friction"), 0u);
  EXPECT_EQ(edit_distance("frition", "friction"), 1u);
  EXPECT_EQ(edit_distance("frriction", "friction"), 1u);
  EXPECT_EQ(edit_distance("frictiom", "friction"), 1u);
  EXPECT_EQ(edit_distance("frictoin", "friction"), 1u);
  // the textbook example of Levenshtein's distance
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("", "dt"), 2u);
  EXPECT_EQ(edit_distance("dt", ""), 2u);
  EXPECT_EQ(edit_distance("Servo", "servo"), 0u);
}

TEST(EditDistance, IsSymmetric)
{
  for (const char *a : {"quiescent", "quiet", "servo_gain", "", "x"})
    for (const char *b : {"servo", "device", "dt_check", "xx", ""})
      EXPECT_EQ(edit_distance(a, b), edit_distance(b, a)) << a << " " << b;
}

TEST(NearestWords, MostSimilarComeFirstAndAtMostThree)
{
  const Words known = {"servo_gain", "device", "servo", "drive", "servo_max_rate", "serves"};

  EXPECT_EQ(nearest_words("serv", known), (Words{"servo", "serves", "servo_gain"}));
  EXPECT_EQ(nearest_words("servo_maxrate", known), (Words{"servo_max_rate", "servo"}));
  EXPECT_EQ(nearest_words("drvie", known), (Words{"drive", "device"}));
  EXPECT_EQ(nearest_words("packings", known), Words{});
}

TEST(NearestWords, ShortWordsAreNotSimilar)
{
  const Words known = {"kn", "kt", "dt", "friction"};

  EXPECT_EQ(nearest_words("mu", known), Words{});
  EXPECT_EQ(nearest_words("kN", known), (Words{"kn", "kt"}));
}

TEST(DidYouMean, NamesSimilarWordsOrElseAll)
{
  const Words known = {"friction", "density"};

  EXPECT_EQ(did_you_mean("frition", known, "there are"), "; did you mean friction?");
  EXPECT_EQ(did_you_mean("colour", known, "there are"), "; there are friction, density");
  EXPECT_EQ(rve::unknown_keyword("colour", known),
            "unknown keyword 'colour'; the keywords are friction, density");
}
