#include "vcharge_camera_driver/candump_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "vcharge_camera_driver/can_wheel_decoder.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

TEST(CandumpFileTest, ReadsFramesOfBothKindsAndLeavesOutOthers) {
  const auto frame = parseCandumpLine("(46408.589503) can0 0AA#25B525B525A0258D");
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->stamp.nanoseconds(), 46408589503000);
  EXPECT_EQ(frame->frame.id, 0xaau);
  EXPECT_FALSE(frame->frame.is_extended);
  EXPECT_EQ(frame->frame.size, 8);
  EXPECT_EQ(frame->frame.data[7], 0x8d);
  const auto extended = parseCandumpLine("(1.5) vcan0 18FEF100#0102 T");
  EXPECT_TRUE(extended->frame.is_extended);
  EXPECT_EQ(extended->frame.id, 0x18fef100u);
  EXPECT_EQ(extended->frame.size, 2);
  EXPECT_EQ(parseCandumpLine("(1.5) can0 123#")->frame.size, 0);
  EXPECT_FALSE(parseCandumpLine("(1.5) can0 123#R8")) << "remote";
  EXPECT_FALSE(parseCandumpLine("(1.5) can0 123##1AABB")) << "CAN FD";
  EXPECT_FALSE(parseCandumpLine("(1.5) can0 20000004#0004000000000000")) << "error";
}

TEST(CandumpFileTest, ErrorsNameFileAndLine) {
  const std::string path = ::testing::TempDir() + "vcharge_can.log";
  const auto errorOf = [&](const std::string& text) -> std::string {
    writeTextFileAtomically(path, text);
    try {
      readCandump(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  using ::testing::HasSubstr;
  const std::string good = "(1.5) can0 123#00\n";
  EXPECT_EQ(errorOf(good + "\n" + good), "no error");
  for (const char* bad :
       {"1.5 can0 123#00", "(1.5) can0", "(1.5) can0 12#00", "(1.5) can0 123#0", "(1.5) can0 123#0g",
        "(x) can0 123#00", "(1.5) can0 123#001122334455667788", "(1.5) can0 123#00 more", "(1.5) can0 12300",
        "(1.5) can1 123#00", "()  can0 123#00"}) {
    EXPECT_THAT(errorOf(good + bad + "\n"), HasSubstr(path + ": line 2: ")) << bad;
  }
  EXPECT_THAT(errorOf("\n"), HasSubstr(path + ": expected a log of candump"));
  writeTextFileAtomically(path, good + "(1.6) can1 123#00\n" + good);
  EXPECT_EQ(readCandump(path, "can0").size(), 2u);
  EXPECT_EQ(readCandump(path, "can1").size(), 1u);
  EXPECT_THROW(readCandump(path, "can2"), InputError);
  std::filesystem::remove(path);
  EXPECT_THROW(readCandump(path), InputError);
}

/// Numbers of a CSV file, without its first line.
std::vector<std::vector<double>> readNumbers(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  std::string line, cell;
  std::getline(file, line);
  while (std::getline(file, line)) {
    rows.emplace_back();
    std::istringstream cells(line);
    while (std::getline(cells, cell, ',')) {
      rows.back().push_back(std::stod(cell));
    }
  }
  return rows;
}

TEST(CandumpFileTest, EveryValueOfARealDriveIsThatOfItsAuthors) {
  const char* data = std::getenv("VCHARGE_DATA");
  if (data == nullptr) {
    GTEST_SKIP() << "VCHARGE_DATA is not set: needs the CAN log of a real car";
  }
  const std::string folder = std::string(data) + "/comma2k19_can/";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << folder << " does not exist: needs the CAN log of a real car";
  }
  CanWheelOptions options;
  readFields(loadYamlFile(VCHARGE_TOYOTA_LAYOUT)["can"], VCHARGE_TOYOTA_LAYOUT, &options);
  constexpr double kRadiansPerDegree = M_PI / 180.0;
  const CanSignal& coarse = options.steering_angle_rad;
  const double rad_per_deg = coarse.scale / 1.5;  // of the steering wheel
  EXPECT_LT(rad_per_deg, kRadiansPerDegree);
  CanWheelDecoder decoder(options);
  std::vector<WheelSpeeds> decoded;
  std::vector<double> steering_deg;
  for (const StampedCanFrame& each : readCandump(folder + "can.log")) {
    if (const auto wheels = decoder.add(each.frame, each.stamp)) {
      decoded.push_back(std::get<WheelSpeeds>(*wheels));
    }
    if (coarse.isIn(each.frame)) {
      steering_deg.push_back(*coarse.value(each.frame) / rad_per_deg);
    }
  }
  EXPECT_EQ(decoder.counts().too_short, 0u);
  EXPECT_EQ(decoder.counts().invalid, 0u);
  const auto expected = readNumbers(folder + "decoded.csv");
  ASSERT_EQ(decoded.size(), expected.size());
  ASSERT_EQ(steering_deg.size(), expected.size());  // the file pairs both messages in their order
  ASSERT_GT(decoded.size(), 4900u);
  constexpr double kLastDigit = 0.5e-6;  // the file has six decimals
  for (size_t i = 0; i < decoded.size(); ++i) {
    const std::vector<double>& row = expected[i];
    ASSERT_NEAR(decoded[i].stamp.seconds(), row.at(0), 1e-6);
    ASSERT_NEAR(decoded[i].front_left_m_per_s, row.at(1), 1.001 * kLastDigit);
    ASSERT_NEAR(decoded[i].front_right_m_per_s, row.at(2), 1.001 * kLastDigit);
    ASSERT_NEAR(decoded[i].rear_left_m_per_s, row.at(3), 1.001 * kLastDigit);
    ASSERT_NEAR(decoded[i].rear_right_m_per_s, row.at(4), 1.001 * kLastDigit);
    ASSERT_NEAR(steering_deg[i], row.at(5), 1e-6) << "row " << i;
  }
}

}  // namespace
}  // namespace vcharge
