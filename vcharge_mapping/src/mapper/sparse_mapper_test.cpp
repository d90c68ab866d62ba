#include "vcharge_mapping/sparse_mapper.h"

#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;

const auto kSilent = [](const StageProgress&) {};

Image grayImage() {
  return {cv::Mat(400, 640, CV_8UC1, cv::Scalar(128)), nullptr};
}

Timestamp at(int frame) {
  return Timestamp::fromNanoseconds(1'000'000'000LL + 80'000'000LL * frame);
}

std::string errorOf(SparseMapper* mapper) {
  try {
    mapper->finish(kSilent);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void addOdometry(SparseMapper* mapper, int frame, double x_m) {
  VehicleOdometry odometry;
  odometry.stamp = at(frame);
  odometry.odom_from_vehicle = RigidTransform::planar(x_m, 0.0, 0.0);
  mapper->addOdometry(odometry);
}

TEST(SparseMapperTest, NamesTheReasonWithoutAMap) {
  {
    SparseMapper mapper(testing::makeTestRig(), SparseMapperOptions());
    EXPECT_THAT(errorOf(&mapper), HasSubstr("0 frames"));
  }
  {
    SparseMapper mapper(testing::makeTestRig(), SparseMapperOptions());
    for (int frame = 0; frame < 5; ++frame) {
      mapper.addImage(0, at(frame), grayImage());
      mapper.addImage(1, at(frame), grayImage());
    }
    EXPECT_THAT(errorOf(&mapper), HasSubstr("5 without odometry"));
  }
  {
    SparseMapper mapper(testing::makeTestRig(), SparseMapperOptions());
    for (int frame = 0; frame < 5; ++frame) {
      addOdometry(&mapper, frame, 0.0);
      mapper.addImage(0, at(frame), grayImage());
      mapper.addImage(1, at(frame), grayImage());
    }
    EXPECT_THAT(errorOf(&mapper), HasSubstr("4 standing"));
  }
  {
    SparseMapper mapper(testing::makeTestRig(), SparseMapperOptions());
    for (int frame = 0; frame < 20; ++frame) {
      addOdometry(&mapper, frame, 0.2 * frame);
      mapper.addImage(0, at(frame), grayImage());
      mapper.addImage(1, at(frame), grayImage());
    }
    EXPECT_THAT(errorOf(&mapper), HasSubstr("no image features"));
  }
}

TEST(SparseMapperTest, CountsIncompleteFramesAndOdometerResets) {
  SparseMapper mapper(testing::makeTestRig(), SparseMapperOptions());
  for (int frame = 0; frame < 10; ++frame) {
    addOdometry(&mapper, frame, frame < 5 ? 100.0 + 0.2 * frame : 0.2 * (frame - 5));
    mapper.addImage(0, at(frame), grayImage());
    if (frame != 3) {
      mapper.addImage(1, at(frame), grayImage());
    }
  }
  errorOf(&mapper);
  EXPECT_EQ(mapper.report().counters.frames, 10);
  EXPECT_EQ(mapper.report().counters.incomplete_frames, 1);
  EXPECT_EQ(mapper.report().counters.odometry_resets, 1);
}

TEST(SparseMapperTest, RefusesARigWithoutExtrinsicsAndBadOptions) {
  auto rig = std::make_shared<CameraRig>(*testing::makeTestRig());
  rig->cameras[1].vehicle_from_camera.reset();
  EXPECT_THROW(SparseMapper(rig, SparseMapperOptions()), InputError);
  SparseMapperOptions options;
  options.keyframe_distance_m = -1.0;
  EXPECT_THROW(SparseMapper(testing::makeTestRig(), options), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
