#include "vcharge_camera_driver/dbc_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr char kCar[] = R"(VERSION "made for this test"

NS_ :
  CM_
BS_:

BU_: BRAKES STEER

BO_ 170 WHEELS: 8 BRAKES
 SG_ FR : 7|16@0+ (0.01,-67.67) [0|250] "km/h" STEER
 SG_ FL : 23|16@0+ (0.01,-67.67) [0|250] "km/h" STEER
 SG_ RR : 39|16@0+ (0.01,-67.67) [0|250] "km/h" STEER
 SG_ RL : 55|16@0+ (0.01,-67.67) [0|250] "km/h" STEER

BO_ 37 STEERING: 8 STEER
 SG_ ANGLE : 3|12@0- (1.5,0) [-500|500] "deg" BRAKES
 SG_ FRACTION : 39|4@0- (0.1,0) [-0.7|0.7] "deg" BRAKES

BO_ 2566844926 STATUS: 5 BRAKES
 SG_ PAGE M : 0|4@1+ (1,0) [0|15] "" STEER
 SG_ COUNT_LEFT m1 : 8|16@1+ (1,0) [0|65535] "" STEER
 SG_ COUNT_RIGHT m2 : 8|16@1+ (1,0) [0|65535] "" STEER
 SG_ SEVERAL m3 : 8|16@1+ (1,0) [0|65535] "" STEER
 SG_ TOO_LONG : 32|16@1+ (1,0) [0|65535] "" STEER
 SG_ OUTSIDE : 70|8@1+ (1,0) [0|0] "" STEER
 SG_ EMPTY : 8|0@1+ (1,0) [0|0] "" STEER
 SG_ UNSCALED : 8|8@1+ (0,0) [0|0] "" STEER
 SG_ FLOAT : 8|32@1- (1,0) [0|0] "" STEER

BO_ 291 NO_PAGE: 8 BRAKES
 SG_ SPEED m1 : 0|16@1+ (0.01,0) [0|0] "m/s" STEER

BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX
 SG_ ORPHAN : 0|8@1+ (1,0) [0|0] "" Vector__XXX

BO_ 292 FAST: 64 BRAKES
 SG_ SPEED : 0|16@1+ (0.01,0) [0|0] "m/s" STEER

CM_ SG_ 170 FR "A comment of two lines,
 SG_ that is no signal";
VAL_ 37 FRACTION 0 "zero" ;
SG_MUL_VAL_ 2566844926 COUNT_LEFT PAGE 1-1;
SG_MUL_VAL_ 2566844926 SEVERAL PAGE 3-3, 5-6;
SIG_VALTYPE_ 2566844926 FLOAT : 1;
)";

class DbcFileTest : public ::testing::Test {
 protected:
  DbcFileTest() : path_(::testing::TempDir() + "vcharge_car.dbc") {}
  ~DbcFileTest() override { std::filesystem::remove(path_); }
  DbcFile fileOf(const std::string& text) const {
    writeTextFileAtomically(path_, text);
    return DbcFile::read(path_);
  }
  std::string errorOf(const std::string& name) const {
    try {
      fileOf(kCar).layoutOf(name);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
  std::string errorIn(const std::string& text) const {
    try {
      fileOf(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  const std::string path_;
};

using ::testing::HasSubstr;

TEST_F(DbcFileTest, ReadsLayoutsInBothByteOrders) {
  const DbcFile car = fileOf(kCar);
  EXPECT_EQ(car.messages().size(), 6u);
  const CanSignal right = car.layoutOf("WHEELS.FR");
  EXPECT_EQ(right.id, 170);
  EXPECT_EQ(right.endianness, ByteOrder::kBig);
  EXPECT_FALSE(right.is_signed);
  EXPECT_EQ(car.unitOf("WHEELS.FR"), "km/h");
  CanFrame frame;
  frame.id = 170;
  frame.size = 8;
  frame.data = {0x25, 0xb5, 0x25, 0xb5, 0x25, 0xa0, 0x25, 0x8d};
  EXPECT_NEAR(*right.value(frame), 0x25b5 * 0.01 - 67.67, 1e-12);
  EXPECT_NEAR(*car.layoutOf("WHEELS.RL").value(frame), 0x258d * 0.01 - 67.67, 1e-12);
  EXPECT_TRUE(car.layoutOf("STEERING.ANGLE").is_signed);
}

TEST_F(DbcFileTest, ReadsMultiplexedSignalsOfExtendedMessages) {
  const CanSignal left = fileOf(kCar).layoutOf("STATUS.COUNT_LEFT");
  EXPECT_EQ(left.id, 2566844926 & 0x1fffffff);
  CanFrame frame;
  frame.id = static_cast<uint32_t>(left.id);
  frame.is_extended = true;
  frame.size = 5;
  frame.data = {0x01, 0x34, 0x12};
  ASSERT_TRUE(left.isIn(frame));
  EXPECT_EQ(left.value(frame), 0x1234);
  EXPECT_FALSE(fileOf(kCar).layoutOf("STATUS.COUNT_RIGHT").isIn(frame));
}

TEST_F(DbcFileTest, ErrorsNameFileMessageAndSignal) {
  const std::string start = path_ + ": message STATUS, signal ";
  EXPECT_EQ(errorOf("STATUS"), path_ + ": expected MESSAGE.SIGNAL, got 'STATUS'");
  EXPECT_EQ(errorOf("BRAKE.FR"), path_ + ": message BRAKE: expected a message of the file");
  EXPECT_EQ(errorOf("STEERING.SPEED"),
            path_ + ": message STEERING, signal SPEED: expected one of ANGLE, FRACTION");
  EXPECT_EQ(errorOf("STATUS.TOO_LONG"), start + "TOO_LONG: expected bits within the message's 5 bytes");
  EXPECT_THAT(errorOf("STATUS.OUTSIDE"), HasSubstr(start + "OUTSIDE: expected a start bit within"));
  EXPECT_EQ(errorOf("STATUS.EMPTY"), start + "EMPTY: expected 1 to 64 bits, has 0");
  EXPECT_THAT(errorOf("STATUS.UNSCALED"), HasSubstr(start + "UNSCALED: scale: must be finite and not 0"));
  EXPECT_THAT(errorOf("STATUS.SEVERAL"), HasSubstr(start + "SEVERAL: expected one multiplexor value"));
  EXPECT_THAT(errorOf("STATUS.FLOAT"), HasSubstr(start + "FLOAT: expected an integer"));
  EXPECT_EQ(errorOf("NO_PAGE.SPEED"), path_ +
                                          ": message NO_PAGE, signal SPEED: expected one multiplexor (M) in "
                                          "the message, has 0");
  EXPECT_THAT(errorOf("VECTOR__INDEPENDENT_SIG_MSG.ORPHAN"),
              HasSubstr("expected a message whose identifier"));
  EXPECT_THAT(errorOf("FAST.SPEED"), HasSubstr("expected a message of classic CAN, up to 8 bytes, has 64"));
}

TEST_F(DbcFileTest, ErrorsOfTheFileNameTheLine) {
  EXPECT_THAT(errorIn(" SG_ A : 0|8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr(path_ + ": line 1: expected a message"));
  const std::string message = "BO_ 1 A: 8 X\n";
  EXPECT_THAT(errorIn(message + "SG_ B 0|8\n"), HasSubstr("line 2: expected ':'"));
  EXPECT_THAT(errorIn(message + "SG_ B q3 : 0|8@1+ (1,0) [0|0] \"\" X\n"), HasSubstr("expected M, or m"));
  EXPECT_THAT(errorIn(message + "SG_ B : x|8@1+ (1,0) [0|0] \"\" X\n"), HasSubstr("expected the start bit"));
  EXPECT_THAT(errorIn(message + "SG_ B : 0|8@2+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("expected byte order 0 or 1"));
  EXPECT_THAT(errorIn(message + "SG_ B : 0|8@1+ 1,0 [0|0] \"\" X\n"), HasSubstr("expected '('"));
  EXPECT_THAT(errorIn(message + "SG_ B : 0|8@1+ (1,0) [0|0]\n"), HasSubstr("expected the unit in quotes"));
  EXPECT_THAT(errorIn("BO_ x A: 8 X\n"), HasSubstr("expected the message's identifier"));
  EXPECT_THAT(errorIn("no DBC file\n"), HasSubstr("expected a DBC file with messages"));
}

}  // namespace
}  // namespace vcharge
