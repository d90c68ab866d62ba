// An odometer with delayed stamps on a drive with turns.
#include "initialization/time_offset.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kSpeed_m_per_s = 2.5;

/// Exact pose of a motion with the heading 0.6 sin(0.7 t).
RigidTransform poseAt(double time_s) {
  static constexpr double kTick_s = 0.001;
  double x = 0.0, y = 0.0;
  const double sign = time_s < 0.0 ? -1.0 : 1.0;
  for (double t = 0.0; t < std::abs(time_s); t += kTick_s) {
    const double heading = 0.6 * std::sin(0.7 * sign * (t + 0.5 * kTick_s));
    x += sign * kSpeed_m_per_s * kTick_s * std::cos(heading);
    y += sign * kSpeed_m_per_s * kTick_s * std::sin(heading);
  }
  return RigidTransform::planar(x, y, 0.6 * std::sin(0.7 * time_s));
}

/// Frames at 12.5 Hz, every third a keyframe; the odometer's poses are `late_s` older than their stamps say.
ReconstructionState makeState(double late_s, int num_frames) {
  ReconstructionState state;
  for (int i = 0; i < num_frames; ++i) {
    const double time_s = 0.08 * i;
    const Timestamp stamp = Timestamp::fromNanoseconds(1000000000 + int64_t{80000000} * i);
    const RigidTransform odom_from_vehicle = poseAt(time_s - late_s);
    if (i % 3 == 0) {
      Keyframe keyframe;
      keyframe.stamp = stamp;
      keyframe.odom_from_vehicle = odom_from_vehicle;
      keyframe.map_from_vehicle = poseAt(time_s);
      state.data.keyframes.push_back(keyframe);
    }
    state.frames.push_back({stamp, static_cast<int32_t>(state.data.keyframes.size()) - 1,
                            state.data.keyframes.back().odom_from_vehicle.inverse() * odom_from_vehicle,
                            MotionHypothesis::kOdometry});
  }
  return state;
}

TEST(OdometrySeriesTest, InterpolatesBetweenFrames) {
  const ReconstructionState state = makeState(0.0, 60);
  const OdometrySeries series(state);
  const Timestamp stamp = state.frames[20].stamp;
  for (const double offset_s : {-0.2, -0.03, 0.0, 0.05, 0.11}) {
    const RigidTransform error = poseAt(1.6 + offset_s).inverse() * series.at(stamp, offset_s);
    EXPECT_LT(error.translation().norm(), 0.001) << offset_s;
    EXPECT_LT(angleOfRotation(error.rotation()), 0.0005) << offset_s;
  }
  // The motion continues beyond the ends.
  const RigidTransform before = poseAt(-0.05).inverse() * series.at(state.frames[0].stamp, -0.05);
  EXPECT_LT(before.translation().norm(), 0.005);
}

TEST(OdometrySeriesTest, ShiftsKeyframesAndFrames) {
  ReconstructionState state = makeState(0.1, 60);
  const OdometrySeries series(state);
  series.shift(0.1, &state);
  for (const FramePose& frame : state.frames) {
    const double time_s = toSeconds(frame.stamp - state.frames[0].stamp);
    if (time_s > 4.5) {
      break;  // the remaining frames are extrapolated beyond the end
    }
    const RigidTransform odom_from_vehicle =
        state.data.keyframes[frame.keyframe].odom_from_vehicle * frame.keyframe_from_vehicle;
    EXPECT_LT((odom_from_vehicle.translation() - poseAt(time_s).translation()).norm(), 0.001) << time_s;
  }
}

TEST(TimeOffsetTest, IsFoundFromAdjustedKeyframes) {
  for (const double late_s : {-0.1, 0.0, 0.02, 0.1}) {
    ReconstructionState state = makeState(late_s, 300);
    const OdometrySeries series(state);
    double offset_s = 0.0;
    for (int i = 0; i < 3; ++i) {
      const TimeOffset more = refineTimeOffset(series, offset_s, state.data);
      offset_s += more.offset_s;
      EXPECT_LT(more.sigma_s, 0.005);
    }
    EXPECT_NEAR(offset_s, late_s, 0.002);
  }
}

TEST(TimeOffsetTest, IsUnknownAtConstantSpeed) {
  ReconstructionState state;
  for (int i = 0; i < 50; ++i) {
    Keyframe keyframe;
    keyframe.stamp = Timestamp::fromNanoseconds(1000000000 + int64_t{200000000} * i);
    keyframe.odom_from_vehicle = keyframe.map_from_vehicle = RigidTransform::planar(0.5 * i, 0.0, 0.0);
    state.data.keyframes.push_back(keyframe);
    state.frames.push_back({keyframe.stamp, i, RigidTransform(), MotionHypothesis::kOdometry});
  }
  const OdometrySeries series(state);
  EXPECT_FALSE(refineTimeOffset(series, 0.0, state.data).isSignificant());
}

}  // namespace
}  // namespace vcharge
