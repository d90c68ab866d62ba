#include "vcharge_core/base/timestamp.h"

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

TEST(TimestampTest, TextKeepsEveryNanosecond) {
  for (const int64_t nanoseconds :
       {int64_t{0}, int64_t{1}, int64_t{1342626148354042001}, int64_t{-1500000000}}) {
    const Timestamp stamp = Timestamp::fromNanoseconds(nanoseconds);
    EXPECT_EQ(timestampFromString(toString(stamp)), stamp);
  }
  EXPECT_EQ(toString(Timestamp::fromNanoseconds(1342626148354042001)), "1342626148.354042001");
  EXPECT_EQ(timestampFromString("12.5").nanoseconds(), 12500000000);
  EXPECT_EQ(timestampFromString("12").nanoseconds(), 12000000000);
}

TEST(TimestampTest, RejectsWhatIsNoTime) {
  for (const char* text : {"", "-", ".5", "1.2.3", "12s", "1.0000000001", "nan", "99999999999"}) {
    EXPECT_THROW(timestampFromString(text), InputError) << text;
  }
}

TEST(TimestampTest, DifferencesAreExact) {
  const Timestamp start = Timestamp::fromNanoseconds(1342626148354042000);
  const Timestamp end = start + durationFromSeconds(0.08);
  EXPECT_EQ((end - start).count(), 80000000);
  EXPECT_EQ(end - Duration(80000000), start);
  EXPECT_LT(start, end);
  EXPECT_DOUBLE_EQ(toSeconds(end - start), 0.08);
}

}  // namespace
}  // namespace vcharge
