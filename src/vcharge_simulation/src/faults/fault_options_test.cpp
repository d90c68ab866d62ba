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

TEST(FaultOptionsTest, ClockOfTheOdometryIsOffAndDriftsInItsInterval) {
  const OdometryStampShiftFault clock =
      read("odometry_stamp_shift: {shift_s: 0.01, drift_ppm: 100, start_s: 2, end_s: 60}")
          .odometry_stamp_shift;
  using std::chrono::microseconds;
  using std::chrono::seconds;
  EXPECT_EQ(clock.shiftAt(seconds(1)), Duration(0));
  EXPECT_EQ(clock.shiftAt(seconds(2)), microseconds(10000));
  EXPECT_EQ(clock.shiftAt(seconds(32)), microseconds(13000));
  EXPECT_EQ(clock.shiftAt(seconds(60)), Duration(0));
  const FaultOptions drifting = read("odometry_stamp_shift: {drift_ppm: -50}");
  EXPECT_TRUE(drifting.odometry_stamp_shift.isActive());
  EXPECT_EQ(drifting.odometry_stamp_shift.shiftAt(seconds(3600)), microseconds(-180000));
}

TEST(FaultOptionsTest, GainsFollowTheOrderOfTheCameras) {
  const FaultOptions each = read("camera_gains: {cameras: [left, front], gains: [0.5, 3]}");
  EXPECT_EQ(each.camera_gains.gainOf("front"), 3.0);
  EXPECT_EQ(each.camera_gains.gainOf("left"), 0.5);
  EXPECT_EQ(each.camera_gains.gainOf("rear"), 1.0);
  EXPECT_EQ(read("camera_gains: {cameras: [all], gains: [3]}").camera_gains.gainOf("rear"), 3.0);
}

TEST(FaultOptionsTest, ShiftsOfStampsFollowTheOrderOfTheCameras) {
  const ImageStampShiftFault shifts =
      read("image_stamp_shift: {cameras: [left, front], shifts_s: [0.01, -0.02], start_s: 1}")
          .image_stamp_shift;
  EXPECT_EQ(shifts.shiftOf("front", std::chrono::seconds(2)), -0.02);
  EXPECT_EQ(shifts.shiftOf("front", std::chrono::seconds(0)), 0.0);
  EXPECT_EQ(shifts.shiftOf("rear", std::chrono::seconds(2)), 0.0);
  EXPECT_EQ(shifts.exposureShiftOf("front", std::chrono::seconds(2)), 0.0);
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
  expectRejected("rolling_shutter: {readout_time_s: 0.1}", "rolling_shutter.readout_time_s");
  expectRejected("auto_exposure: {target_gray: 0}", "auto_exposure.target_gray");
  expectRejected("camera_gains: {cameras: [left, front, rear], gains: [1, 2]}", "camera_gains.gains");
  expectRejected("camera_gains: {cameras: [left], gains: [0]}", "camera_gains.gains");
  expectRejected("image_stamp_shift: {cameras: [left], shifts_s: [1, 2]}", "image_stamp_shift.shifts_s");
  expectRejected("image_stamp_shift: {cameras: [left], shifts_s: [0.2], moves_exposure: true}",
                 "image_stamp_shift.shifts_s");
  expectRejected("vignetting: {rim_loss: 1}", "vignetting.rim_loss");
  expectRejected("water_drop: {radius: 0}", "water_drop.radius");
  expectRejected("low_light: {level: 0}", "low_light.level");
  expectRejected("bright_lamps: {positions_m: [1, 2]}", "bright_lamps.positions_m");
  expectRejected("bright_lamps: {positions_m: [1, 2, .nan]}", "bright_lamps.positions_m");
  expectRejected("bright_lamps: {image_positions: [0.5]}", "bright_lamps.image_positions");
  expectRejected("odometry_stamp_shift: {drift_ppm: .inf}", "odometry_stamp_shift.drift_ppm");
  expectRejected("wheel_slip: {wheel: front}", "wheel_slip.wheel");
  expectRejected("wheel_slip: {ratio: -2}", "wheel_slip.ratio");
  expectRejected("odometry_scale: {factor: .nan}", "odometry_scale.factor");
  expectRejected("counter_reset: {time_s: -1}", "counter_reset.time_s");
  expectRejected("soft_suspension: {pitch_factor: -1}", "soft_suspension.pitch_factor");
  expectRejected("loaded_boot: {pitch_rad: -0.1}", "loaded_boot.pitch_rad");
}

}  // namespace
}  // namespace vcharge
