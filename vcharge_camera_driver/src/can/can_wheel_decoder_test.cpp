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

/// The ticks that a frame completed.
std::optional<WheelTicks> addTo(CanWheelDecoder* decoder, const CanFrame& frame, Timestamp stamp) {
  const auto wheels = decoder->add(frame, stamp);
  return wheels ? std::optional<WheelTicks>(std::get<WheelTicks>(*wheels)) : std::nullopt;
}

CanFrame ticksFrame(int left, int right) {
  return frameOf(0x1a0,
                 {static_cast<uint8_t>(left & 255), static_cast<uint8_t>(left >> 8 & 3),
                  static_cast<uint8_t>(right & 255), static_cast<uint8_t>(right >> 8 & 3), 0, 0, 0, 0});
}

TEST(CanWheelDecoderTest, CountersWrapForwardsAndBackwards) {
  CanWheelDecoder decoder(ticksOptions());
  int64_t left = 1000;
  int64_t right = 5;
  const int64_t left_start = left;
  const int64_t right_start = right;
  for (int i = 0; i < 500; ++i) {
    const auto ticks = addTo(
        &decoder, ticksFrame(static_cast<int>(left & 1023), static_cast<int>(right & 1023)), at(0.02 * i));
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
                           ? addTo(&decoder, ticksFrame(5 * i & 1023, 6 * i & 1023), at(0.02 * i))
                           : std::nullopt;
    last = ticks ? ticks : last;
  }
  EXPECT_EQ(last->left_ticks, 5000);
  EXPECT_EQ(last->right_ticks, 6000);
}

TEST(CanWheelDecoderTest, AResetOfTheCountersIsNoMotion) {
  CanWheelDecoder decoder(ticksOptions());
  addTo(&decoder, ticksFrame(500, 500), at(0.0));
  addTo(&decoder, ticksFrame(510, 510), at(0.02));
  const auto after = addTo(&decoder, ticksFrame(0, 0), at(0.04));
  EXPECT_EQ(after->left_ticks, 10);
  EXPECT_EQ(decoder.counts().resets, 2u);
  // During the silence the counter may have wrapped, so the distance is unknown.
  const auto later = addTo(&decoder, ticksFrame(20, 20), at(60.0));
  EXPECT_EQ(later->left_ticks, 10);
  EXPECT_EQ(decoder.counts().resets, 4u);
  EXPECT_EQ(addTo(&decoder, ticksFrame(25, 25), at(60.02))->left_ticks, 15);
}

TEST(CanWheelDecoderTest, TakesSteeringDirectionAndWheelsOfSeveralMessages) {
  CanWheelOptions options = ticksOptions();
  options.right_ticks.id = 0x1a1;
  options.backwards.id = 0x0c3;
  options.backwards.start_bit = 3;
  options.backwards.length = 1;
  CanWheelDecoder decoder(options);
  EXPECT_FALSE(addTo(&decoder, frameOf(0x0c2, {0xfe, 0x0c, 0, 0, 0, 0, 0, 0}), at(0.0)));  // -500
  EXPECT_FALSE(addTo(&decoder, ticksFrame(1020, 0), at(0.0)));
  CanFrame right = ticksFrame(0, 1000);
  right.id = 0x1a1;
  const auto first = addTo(&decoder, right, at(0.001));
  ASSERT_TRUE(first);
  EXPECT_NEAR(first->steering_angle_rad, -0.05, 1e-12);
  EXPECT_FALSE(addTo(&decoder, ticksFrame(4, 0), at(0.02)));
  addTo(&decoder, frameOf(0x0c3, {8, 0, 0, 0, 0, 0, 0, 0}), at(0.02));
  right = ticksFrame(0, 1010);
  right.id = 0x1a1;
  const auto second = addTo(&decoder, right, at(0.021));
  EXPECT_EQ(second->left_ticks, 8);
  EXPECT_EQ(second->right_ticks, -10);
}

CanWheelOptions speedsOptions() {
  CanWheelOptions options;
  readFields(YAML::Load("{left_speed_m_per_s: {id: 1, length: 16, scale: 0.01}, "
                        "right_speed_m_per_s: {id: 1, start_bit: 16, length: 16, scale: 0.01}, "
                        "front_left_speed_m_per_s: {id: 2, length: 16, scale: 0.01}, "
                        "front_right_speed_m_per_s: {id: 2, start_bit: 16, length: 16, scale: 0.01}, "
                        "backwards: {id: 3, length: 4}, backwards_value: 7, "
                        "steering_angle_rad: {id: 4, length: 16, is_signed: true, scale: 0.001}}"),
             "can.yaml", &options);
  return options;
}

CanFrame wordsFrame(uint32_t id, int first, int second) {
  return frameOf(id,
                 {static_cast<uint8_t>(first & 255), static_cast<uint8_t>(first >> 8 & 255),
                  static_cast<uint8_t>(second & 255), static_cast<uint8_t>(second >> 8 & 255), 0, 0, 0, 0});
}

TEST(CanWheelDecoderTest, TellsSpeedsOfTheRearWheelsWithWhatIsNewOfTheOthers) {
  CanWheelDecoder decoder(speedsOptions());
  const auto add = [&](uint32_t id, int first, int second, double time_s) {
    return decoder.add(wordsFrame(id, first, second), at(time_s));
  };
  auto wheels = add(1, 500, 510, 0.0);
  ASSERT_TRUE(wheels);
  auto speeds = std::get<WheelSpeeds>(*wheels);
  EXPECT_DOUBLE_EQ(speeds.rear_left_m_per_s, 5.0);
  EXPECT_DOUBLE_EQ(speeds.rear_right_m_per_s, 5.1);
  EXPECT_TRUE(std::isnan(speeds.front_left_m_per_s));
  EXPECT_TRUE(std::isnan(speeds.steering_angle_rad));
  EXPECT_FALSE(add(2, 520, 530, 0.01));
  EXPECT_FALSE(add(4, -200, 0, 0.01));
  speeds = std::get<WheelSpeeds>(*add(1, 500, 510, 0.02));
  EXPECT_DOUBLE_EQ(speeds.front_left_m_per_s, 5.2);
  EXPECT_DOUBLE_EQ(speeds.front_right_m_per_s, 5.3);
  EXPECT_DOUBLE_EQ(speeds.steering_angle_rad, -0.2);
  speeds = std::get<WheelSpeeds>(*add(1, 500, 510, 0.5));
  EXPECT_TRUE(std::isnan(speeds.front_right_m_per_s)) << "the front wheels are silent";
  EXPECT_TRUE(std::isnan(speeds.steering_angle_rad));
}

TEST(CanWheelDecoderTest, TheGearGivesSpeedsTheirSign) {
  CanWheelDecoder decoder(speedsOptions());
  const auto speedInGear = [&](int gear) {
    decoder.add(wordsFrame(3, gear, 0), at(0.0));
    return std::get<WheelSpeeds>(*decoder.add(wordsFrame(1, 200, 200), at(0.0))).rear_left_m_per_s;
  };
  EXPECT_EQ(speedInGear(1), 2.0);
  EXPECT_EQ(speedInGear(7), -2.0);
  EXPECT_EQ(speedInGear(0), 2.0);
}

TEST(CanWheelDecoderTest, SpeedsThatMarkAFailureAreNotTold) {
  CanWheelDecoder decoder(speedsOptions());
  EXPECT_FALSE(decoder.add(wordsFrame(1, 0xffff, 500), at(0.0)));
  EXPECT_EQ(decoder.counts().invalid, 1u);
  EXPECT_TRUE(decoder.add(wordsFrame(1, 500, 500), at(0.02)));
}

TEST(CanWheelDecoderTest, EachRearWheelMayHaveItsMessage) {
  CanWheelOptions options = speedsOptions();
  options.right_speed_m_per_s.id = 5;
  CanWheelDecoder decoder(options);
  EXPECT_FALSE(decoder.add(wordsFrame(1, 500, 0), at(0.0)));
  EXPECT_TRUE(decoder.add(wordsFrame(5, 0, 510), at(0.001)));
  EXPECT_FALSE(decoder.add(wordsFrame(1, 500, 0), at(0.02)));
  EXPECT_FALSE(decoder.add(wordsFrame(1, 505, 0), at(0.04))) << "the other message was lost";
  const auto wheels = decoder.add(wordsFrame(5, 0, 515), at(0.041));
  EXPECT_DOUBLE_EQ(std::get<WheelSpeeds>(*wheels).rear_left_m_per_s, 5.05);
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
    const auto ticks = addTo(&decoder, frame, at(time_s));
    if (ticks && last) {
      const double most = 60.0 * forwards_s / 0.02 + 4.0 * num_frames;
      ASSERT_LE(std::abs(static_cast<double>(ticks->left_ticks - last->left_ticks)), most);
      ASSERT_FALSE(std::isinf(ticks->steering_angle_rad));  // NaN: unknown
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
  EXPECT_THAT(errorFrom("{right_ticks: {start_bit: 8}}"), HasSubstr("message 0x1a0 than left_ticks"));
  EXPECT_THAT(errorFrom("{left_ticks: {plus: {start_bit: 40, length: 4}}}"), HasSubstr("plus"));
  EXPECT_THAT(errorFrom("{backwards: {start_bit: 3, length: 1}}"), HasSubstr("backwards.id: must be given"));
  EXPECT_THAT(errorFrom("{front_left_speed_m_per_s: {id: 9, length: 8}}"), HasSubstr("both front wheels"));
  EXPECT_THAT(errorFrom("{steering_angle_rad: {scale: 0}}"), HasSubstr("steering_angle_rad.scale: "));
  EXPECT_THAT(errorFrom("{steering_angle_rad: {multiplexor: {length: 2, value: 4}}}"),
              HasSubstr("steering_angle_rad.multiplexor.value: "));
  EXPECT_THAT(errorFrom("{steering_angle_rad: {multiplexor: {value: 4}}}"),
              HasSubstr("steering_angle_rad.multiplexor.length: "));
  EXPECT_THAT(errorFrom("{steering_angle_rad: {plus: {start_bit: 7, length: 4}}}"),
              HasSubstr("steering_angle_rad.plus.start_bit: "));
  EXPECT_THAT(errorFrom("{metres_per_tick: 0}"), HasSubstr("metres_per_tick: "));
  EXPECT_THAT(errorFrom("{left_speed_m_per_s: {id: 1, length: 8}}"), HasSubstr("both wheels"));
  EXPECT_EQ(errorFrom("{}"), "no error");
}

}  // namespace
}  // namespace vcharge
