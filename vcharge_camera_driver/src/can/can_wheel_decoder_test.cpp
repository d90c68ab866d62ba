#include "vcharge_camera_driver/can_wheel_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

const Timestamp kStart = Timestamp::fromNanoseconds(1700000000000000000);
Timestamp at(double seconds) {
  return kStart + durationFromSeconds(seconds);
}

CanFrame frameOf(uint32_t id, std::array<uint8_t, 8> data, uint8_t size = 8) {
  CanFrame frame;
  frame.id = id;
  frame.is_extended = id > 0x7ff;
  frame.size = size;
  frame.data = data;
  return frame;
}

CanWheelOptions ticksOptions() {
  CanWheelOptions options;
  readFields(
      YAML::Load(
          "{left_ticks: {id: 0x1a0, start_bit: 0, length: 10}, "
          "right_ticks: {id: 0x1a0, start_bit: 16, length: 10}, "
          "steering_angle_rad: {id: 0x0c2, start_bit: 7, length: 16, endianness: big, is_signed: true, "
          "scale: 0.0001}, metres_per_tick: 0.02}"),
      "can.yaml", &options);
  return options;
}

CanFrame ticksFrame(int left, int right) {
  return frameOf(0x1a0,
                 {static_cast<uint8_t>(left & 255), static_cast<uint8_t>(left >> 8 & 3),
                  static_cast<uint8_t>(right & 255), static_cast<uint8_t>(right >> 8 & 3), 0, 0, 0, 0});
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

TEST(CanWheelDecoderTest, CountersWrapForwardsAndBackwards) {
  CanWheelDecoder decoder(ticksOptions());
  int64_t left = 1000;
  int64_t right = 5;
  const int64_t left_start = left;
  const int64_t right_start = right;
  for (int i = 0; i < 500; ++i) {
    const auto ticks =
        decoder.add(ticksFrame(static_cast<int>(left & 1023), static_cast<int>(right & 1023)), at(0.02 * i));
    ASSERT_TRUE(ticks);
    ASSERT_EQ(ticks->left_ticks, left - left_start);
    ASSERT_EQ(ticks->right_ticks, right - right_start);
    ASSERT_EQ(ticks->metres_per_tick, 0.02);
    left += 11;
    right -= 7;
  }
  EXPECT_EQ(decoder.counts().wraps, 6u + 4u);  // 1000 + 499 x 11 and 5 - 499 x 7, modulo 1024
  EXPECT_EQ(decoder.counts().resets, 0u);
}

TEST(CanWheelDecoderTest, NoDistanceIsLostWithMissingMessages) {
  CanWheelDecoder decoder(ticksOptions());
  std::mt19937 random(9);
  std::optional<WheelTicks> last;
  for (int i = 0; i <= 1000; ++i) {
    const auto ticks = i == 0 || i == 1000 || random() % 2 == 0
                           ? decoder.add(ticksFrame(5 * i & 1023, 6 * i & 1023), at(0.02 * i))
                           : std::nullopt;
    last = ticks ? ticks : last;
  }
  EXPECT_EQ(last->left_ticks, 5000);
  EXPECT_EQ(last->right_ticks, 6000);
}

TEST(CanWheelDecoderTest, AResetOfTheCountersIsNoMotion) {
  CanWheelDecoder decoder(ticksOptions());
  decoder.add(ticksFrame(500, 500), at(0.0));
  decoder.add(ticksFrame(510, 510), at(0.02));
  const auto after = decoder.add(ticksFrame(0, 0), at(0.04));
  EXPECT_EQ(after->left_ticks, 10);
  EXPECT_EQ(decoder.counts().resets, 2u);
  // During the silence the counter may have wrapped, so the distance is unknown.
  const auto later = decoder.add(ticksFrame(20, 20), at(60.0));
  EXPECT_EQ(later->left_ticks, 10);
  EXPECT_EQ(decoder.counts().resets, 4u);
  EXPECT_EQ(decoder.add(ticksFrame(25, 25), at(60.02))->left_ticks, 15);
}

TEST(CanWheelDecoderTest, TakesSteeringDirectionAndWheelsOfSeveralMessages) {
  CanWheelOptions options = ticksOptions();
  options.right_ticks.id = 0x1a1;
  options.backwards.id = 0x0c3;
  options.backwards.start_bit = 3;
  options.backwards.length = 1;
  CanWheelDecoder decoder(options);
  EXPECT_FALSE(decoder.add(frameOf(0x0c2, {0xfe, 0x0c, 0, 0, 0, 0, 0, 0}), at(0.0)));  // -500
  EXPECT_FALSE(decoder.add(ticksFrame(1020, 0), at(0.0)));
  CanFrame right = ticksFrame(0, 1000);
  right.id = 0x1a1;
  const auto first = decoder.add(right, at(0.001));
  ASSERT_TRUE(first);
  EXPECT_NEAR(first->steering_angle_rad, -0.05, 1e-12);
  EXPECT_FALSE(decoder.add(ticksFrame(4, 0), at(0.02)));
  decoder.add(frameOf(0x0c3, {8, 0, 0, 0, 0, 0, 0, 0}), at(0.02));
  right = ticksFrame(0, 1010);
  right.id = 0x1a1;
  const auto second = decoder.add(right, at(0.021));
  EXPECT_EQ(second->left_ticks, 8);
  EXPECT_EQ(second->right_ticks, -10);
}

TEST(CanWheelDecoderTest, IntegratesSpeeds) {
  CanWheelOptions options;
  readFields(YAML::Load("{left_speed_m_per_s: {id: 1, length: 16, scale: 0.01}, "
                        "right_speed_m_per_s: {id: 1, start_bit: 16, length: 16, scale: 0.01}}"),
             "can.yaml", &options);
  CanWheelDecoder decoder(options);
  std::optional<WheelTicks> ticks;
  // 10 s: the left wheel accelerates by 0.5 m/s^2, the right one moves at 3 m/s
  for (int i = 0; i <= 500; ++i) {
    const int left = i;
    ticks = decoder.add(frameOf(1, {static_cast<uint8_t>(left & 255), static_cast<uint8_t>(left >> 8),
                                    300 & 255, 1, 0, 0, 0, 0}),
                        at(0.02 * i));
  }
  EXPECT_NEAR(static_cast<double>(ticks->left_ticks) * ticks->metres_per_tick, 25.0, 1e-3);
  EXPECT_NEAR(static_cast<double>(ticks->right_ticks) * ticks->metres_per_tick, 30.0, 1e-3);
}

TEST(CanWheelDecoderTest, FuzzedFramesNeverCrashItNorMoveTheCarFasterThanItCan) {
  std::mt19937 random(13);
  CanWheelDecoder decoder(ticksOptions());
  double time_s = 0.0;
  std::optional<WheelTicks> last;
  double forwards_s = 0.0;  // since the last ticks
  int num_frames = 0;
  for (int i = 0; i < 20000; ++i) {
    CanFrame frame;
    const uint32_t choice = random() % 4;
    frame.id = choice == 0 ? random() & 0x1fffffff : choice == 1 ? 0x0c2 : 0x1a0;
    frame.is_extended = random() % 8 == 0;
    frame.size = static_cast<uint8_t>(random() % 9);
    for (uint8_t& byte : frame.data) {
      byte = static_cast<uint8_t>(random());
    }
    const double direction_s = random() % 64 == 0 ? -0.5 : 0.001;
    const double step_s = direction_s * static_cast<double>(random() % 10);
    time_s += step_s;
    forwards_s += std::max(0.0, step_s);
    ++num_frames;
    const auto ticks = decoder.add(frame, at(time_s));
    if (ticks && last) {
      const double most = 60.0 * forwards_s / 0.02 + 4.0 * num_frames;
      ASSERT_LE(std::abs(static_cast<double>(ticks->left_ticks - last->left_ticks)), most);
      ASSERT_TRUE(std::isfinite(ticks->steering_angle_rad));
    }
    if (ticks) {
      last = ticks;
      forwards_s = 0.0;
      num_frames = 0;
    }
  }
  EXPECT_GT(decoder.counts().resets, 100u);
  EXPECT_GT(decoder.counts().too_short, 100u);
}

TEST(CanWheelOptionsTest, RejectsBadDescriptionsByName) {
  const auto errorFrom = [](const std::string& yaml) -> std::string {
    CanWheelOptions options = ticksOptions();
    try {
      readFields(YAML::Load(yaml), "can.yaml", &options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(errorFrom("{left_ticks: {id: -1}}"), HasSubstr("both wheels"));
  EXPECT_THAT(errorFrom("{left_ticks: {id: 0x20000000}}"), HasSubstr("left_ticks.id: "));
  EXPECT_THAT(errorFrom("{left_ticks: {start_bit: 60}}"), HasSubstr("left_ticks.length: "));
  EXPECT_THAT(errorFrom("{left_ticks: {length: 0}}"), HasSubstr("left_ticks.length: "));
  EXPECT_THAT(errorFrom("{right_ticks: {scale: 2}}"), HasSubstr("scale"));
  EXPECT_THAT(errorFrom("{left_ticks: {endianness: middle}}"),
              HasSubstr("left_ticks.endianness: expected one of little, big"));
  EXPECT_THAT(errorFrom("{left_ticks: {bits: 3}}"), HasSubstr("left_ticks.bits: unknown key"));
  EXPECT_THAT(errorFrom("{metres_per_tick: 0}"), HasSubstr("metres_per_tick: "));
  EXPECT_THAT(errorFrom("{left_speed_m_per_s: {id: 1, length: 8}}"), HasSubstr("both wheels"));
  EXPECT_EQ(errorFrom("{}"), "no error");
}

}  // namespace
}  // namespace vcharge
