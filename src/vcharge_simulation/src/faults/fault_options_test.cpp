#include "vcharge_simulation/faults/fault_options.h"

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

FaultOptions read(const std::string& text) {
  FaultOptions faults;
  readFields(YAML::Load(text), "faults.yaml", &faults);
  return faults;
}

void expectRejected(const std::string& text, const std::string& key) {
  try {
    read(text);
    ADD_FAILURE() << text;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
  }
}

TEST(FaultOptionsTest, NothingIsWrongByDefault) {
  const FaultOptions faults;
  faults.validate();
  forEachOption(faults, [](const OptionDeclaration& option, const auto& fault) {
    EXPECT_FALSE(fault.isActive()) << option.name;
  });
}

TEST(FaultOptionsTest, ActFromTheStartUntilBeforeTheEnd) {
  const FaultOptions faults = read("dead_camera: {cameras: [left, rear], start_s: 0.4, end_s: 0.8}");
  const auto acts = [&](const char* camera, int milliseconds) {
    return faults.dead_camera.actsOn(camera, std::chrono::milliseconds(milliseconds));
  };
  EXPECT_FALSE(acts("left", 399));
  EXPECT_TRUE(acts("left", 400));
  EXPECT_TRUE(acts("rear", 799));
  EXPECT_FALSE(acts("left", 800));
  EXPECT_FALSE(acts("front", 500));
  const FaultOptions forever = read("dead_camera: {cameras: [all]}");
  EXPECT_TRUE(forever.dead_camera.actsOn("front", std::chrono::hours(1)));
  EXPECT_TRUE(forever.dead_camera.actsOn("front", std::chrono::milliseconds(-500)));
}

TEST(FaultOptionsTest, BadValuesAreNamed) {
  expectRejected("dead_camera: {cameras: [left], start_s: 2, end_s: 1}", "dead_camera.end_s");
  expectRejected("dead_camera: {camera: left}", "dead_camera.camera");
  expectRejected("dead_kamera: {cameras: [left]}", "dead_kamera");
  expectRejected("bumped_camera: {rotation_rad: [0.1]}", "bumped_camera.rotation_rad");
  expectRejected("swapped_cameras: {cameras: [left]}", "swapped_cameras.cameras");
  expectRejected("swapped_cameras: {cameras: [left, left]}", "swapped_cameras.cameras");
  expectRejected("dropped_images: {probability: 1.5}", "dropped_images.probability");
  expectRejected("late_images: {delay_s: 0}", "late_images.delay_s");
  expectRejected("exposure_step: {gain: 0}", "exposure_step.gain");
  expectRejected("motion_blur: {exposure_time_s: 1}", "motion_blur.exposure_time_s");
  expectRejected("wheel_slip: {wheel: front}", "wheel_slip.wheel");
  expectRejected("wheel_slip: {ratio: -2}", "wheel_slip.ratio");
  expectRejected("odometry_scale: {factor: .nan}", "odometry_scale.factor");
  expectRejected("counter_reset: {time_s: -1}", "counter_reset.time_s");
  expectRejected("soft_suspension: {pitch_factor: -1}", "soft_suspension.pitch_factor");
}

}  // namespace
}  // namespace vcharge
