#include "vcharge_camera_driver/can_signal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace vcharge {
namespace {

CanFrame frameOf(uint32_t id, std::array<uint8_t, 8> data, uint8_t size = 8) {
  CanFrame frame;
  frame.id = id;
  frame.is_extended = id > 0x7ff;
  frame.size = size;
  frame.data = data;
  return frame;
}

TEST(CanSignalTest, ReadsBitsInBothByteOrders) {
  CanSignal signal;
  signal.id = 1;
  const CanFrame frame = frameOf(1, {0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc, 0xde, 0xf0});
  signal.start_bit = 8;
  signal.length = 16;
  EXPECT_EQ(signal.rawBits(frame), 0x5634u);
  signal.start_bit = 4;
  signal.length = 12;
  EXPECT_EQ(signal.rawBits(frame), 0x341u);
  signal.endianness = ByteOrder::kBig;
  signal.start_bit = 15;  // the highest bit of byte 1
  signal.length = 16;
  EXPECT_EQ(signal.rawBits(frame), 0x3456u);
  signal.start_bit = 3;  // the lower half of byte 0, then byte 1
  signal.length = 12;
  EXPECT_EQ(signal.rawBits(frame), 0x234u);
  signal.start_bit = 7;
  signal.length = 64;
  EXPECT_EQ(signal.rawBits(frame), 0x123456789abcdef0u);
  signal.endianness = ByteOrder::kLittle;
  signal.start_bit = 0;
  EXPECT_EQ(signal.rawBits(frame), 0xf0debc9a78563412u);
}

TEST(CanSignalTest, TakesAnyNumberThatWasPutIn) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 2000; ++round) {
    CanSignal signal;
    signal.id = 7;
    signal.length = 1 + static_cast<int>(random() % 63);
    signal.start_bit = static_cast<int>(random() % static_cast<uint64_t>(65 - signal.length));
    signal.is_signed = random() % 2 == 0;
    signal.scale = 0.5;
    signal.offset = -3.0;
    const uint64_t raw = random() & ((uint64_t{1} << signal.length) - 1);
    const uint64_t noise = random();
    const uint64_t mask = ((uint64_t{1} << signal.length) - 1) << signal.start_bit;
    const uint64_t word = (noise & ~mask) | raw << signal.start_bit;
    CanFrame frame = frameOf(7, {});
    for (size_t i = 0; i < 8; ++i) {
      frame.data[i] = static_cast<uint8_t>(word >> (8 * i));
    }
    const bool negative = signal.is_signed && (raw >> (signal.length - 1)) != 0;
    const double number =
        negative ? static_cast<double>(raw) - std::ldexp(1.0, signal.length) : static_cast<double>(raw);
    ASSERT_NEAR(*signal.value(frame), 0.5 * number - 3.0, 1e-6 + 1e-12 * std::abs(number));
  }
}

TEST(CanSignalTest, AFrameThatEndsBeforeTheSignalHasNoValue) {
  CanSignal signal;
  signal.id = 1;
  signal.start_bit = 14;
  signal.length = 4;  // bits 14 to 17: bytes 1 and 2
  EXPECT_FALSE(signal.value(frameOf(1, {}, 2)));
  EXPECT_TRUE(signal.value(frameOf(1, {}, 3)));
}

TEST(CanSignalTest, AddsTwoParts) {
  // Half turns in a signed 12 bit number, tenths of degrees in a signed 4 bit number.
  CanSignal signal;
  signal.id = 0x25;
  signal.start_bit = 3;
  signal.length = 12;
  signal.endianness = ByteOrder::kBig;
  signal.is_signed = true;
  signal.scale = 1.5;
  signal.plus = {39, 4, ByteOrder::kBig, true, 0.1, 0.0};
  signal.validate();
  EXPECT_NEAR(*signal.value(frameOf(0x25, {0x00, 0x00, 0x10, 0x00, 0xc0, 0, 0, 0xfd})), -0.4, 1e-12);
  EXPECT_NEAR(*signal.value(frameOf(0x25, {0x0f, 0xff, 0, 0, 0x70, 0, 0, 0})), -1.5 + 0.7, 1e-12);
  EXPECT_FALSE(signal.value(frameOf(0x25, {}, 4))) << "ends before the second part";
}

TEST(CanSignalTest, AMultiplexedSignalIsInSomeOfTheMessages) {
  CanSignal speed;
  speed.id = 7;
  speed.start_bit = 8;
  speed.length = 8;
  speed.multiplexor = {4, 4, ByteOrder::kLittle, 2};
  speed.validate();
  EXPECT_TRUE(speed.isIn(frameOf(7, {0x2f, 5})));
  EXPECT_EQ(speed.value(frameOf(7, {0x2f, 5})), 5.0);
  EXPECT_FALSE(speed.isIn(frameOf(7, {0x3f, 5})));
  EXPECT_FALSE(speed.isIn(frameOf(8, {0x2f, 5})));
  EXPECT_TRUE(speed.isIn(frameOf(7, {}, 0)));
  EXPECT_FALSE(speed.value(frameOf(7, {}, 0))) << "too short";

  CanSignal other = speed;
  EXPECT_TRUE(other.overlaps(speed));
  other.multiplexor.value = 3;
  EXPECT_FALSE(other.overlaps(speed)) << "never in one message";
  other.multiplexor = {};
  EXPECT_TRUE(other.overlaps(speed));
  other.start_bit = 16;
  EXPECT_FALSE(other.overlaps(speed));
  other = speed;
  other.id = 8;
  EXPECT_FALSE(other.overlaps(speed));
}

}  // namespace
}  // namespace vcharge
