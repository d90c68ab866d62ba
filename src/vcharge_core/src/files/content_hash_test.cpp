#include "vcharge_core/files/content_hash.h"

#include <limits>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

template <class... Values>
std::string hashOf(const Values&... values) {
  ContentHasher hasher;
  (hasher.add(values), ...);
  return hasher.hex();
}

TEST(ContentHasherTest, SameContentSameHashOtherContentOtherHash) {
  EXPECT_EQ(hashOf(1.5, std::string("a")), hashOf(1.5, std::string("a")));
  EXPECT_NE(hashOf(1.5), hashOf(1.5000000000000002));
  EXPECT_NE(hashOf(1.0, 2.0), hashOf(2.0, 1.0));
  EXPECT_EQ(hashOf(1.0).size(), 32U);
}

TEST(ContentHasherTest, TextsDoNotRunIntoEachOther) {
  EXPECT_NE(hashOf(std::string("ab"), std::string("c")), hashOf(std::string("a"), std::string("bc")));
}

TEST(ContentHasherTest, EveryNanAndBothZerosCountTheSame) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(hashOf(nan), hashOf(-nan));
  EXPECT_EQ(hashOf(0.0), hashOf(-0.0));
}

TEST(ContentHasherTest, ReadingTheHashDoesNotChangeIt) {
  ContentHasher hasher;
  hasher.add(int64_t{7});
  const std::string before = hasher.hex();
  EXPECT_EQ(hasher.hex(), before);
  hasher.add(int64_t{8});
  EXPECT_NE(hasher.hex(), before);
}

}  // namespace
}  // namespace vcharge
