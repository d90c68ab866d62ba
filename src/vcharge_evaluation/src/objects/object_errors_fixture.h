#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "vcharge_evaluation/object_errors.h"

namespace vcharge {

inline constexpr int kNumFrames = 31;
inline constexpr int64_t kStep_ns = 100'000'000;
inline constexpr int kFirstDue = 5;  // 0.5 s
inline constexpr double kSigma_m = 0.1;

inline Outline rectangle(const RigidTransform& frame_from_object, double length_m, double width_m) {
  return vehicleOutline(frame_from_object, 0.5 * length_m, -0.5 * length_m, 0.5 * width_m);
}

inline TrackedObject objectAt(uint32_t id, const RigidTransform& frame_from_object,
                              const Eigen::Vector2d& velocity, double length_m = 0.5, double width_m = 0.5) {
  TrackedObject object;
  object.id = id;
  object.object_class = ObjectClass::kAdult;
  object.frame_from_object = frame_from_object;
  object.velocity_m_per_s = {velocity.x(), velocity.y(), 0.0};
  object.footprint_m = rectangle(frame_from_object, length_m, width_m);
  object.height_m = 1.7;
  object.covariance.topLeftCorner<2, 2>() = kSigma_m * kSigma_m * Eigen::Matrix2d::Identity();
  return object;
}

inline TrackedObject transformed(TrackedObject object, const RigidTransform& target_from_source) {
  object.frame_from_object = target_from_source * object.frame_from_object;
  object.velocity_m_per_s = target_from_source.rotation() * object.velocity_m_per_s;
  for (Eigen::Vector2d& corner : object.footprint_m) {
    corner = (target_from_source * Eigen::Vector3d(corner.x(), corner.y(), 0.0)).head<2>();
  }
  const Eigen::Matrix3d rotation = target_from_source.rotationMatrix();
  object.covariance.topLeftCorner<3, 3>() =
      rotation * object.covariance.topLeftCorner<3, 3>() * rotation.transpose();
  return object;
}

/// A drive of 3 s past a person who walks at 1 m/s across the vehicle's way, 4.25 m ahead of its front. The
/// odometry's frame has nothing to do with the world's.
class ObjectErrorsFixture : public ::testing::Test {
 protected:
  struct Frame {
    TrueObjectFrame truth;
    std::vector<TrackedObject> reports;  // in the world
  };
  using Change = std::function<void(int index, Frame* frame)>;

  ObjectErrorsFixture() : odom_from_world_(RigidTransform::planar(30.0, -7.0, 2.5)) {}

  static RigidTransform vehicleAt(int index) { return RigidTransform::planar(0.02 * index, 1.0, 0.0); }
  static RigidTransform personAt(int index) {
    return RigidTransform::planar(vehicleAt(index).translation().x() + kVehicleFront_m + 4.5,
                                  0.1 * index - 0.5, 0.5 * M_PI);
  }
  static Frame frameAt(int index) {
    Frame frame;
    frame.truth.stamp = Timestamp::fromNanoseconds(1'000'000'000 + index * kStep_ns);
    frame.truth.world_from_vehicle = vehicleAt(index);
    frame.truth.objects = {objectAt(1, personAt(index), {0.2, 1.0})};
    frame.truth.visible_fraction = {1.0};
    frame.reports = frame.truth.objects;
    frame.reports[0].id = 70;
    return frame;
  }
  ObjectErrors judge(const Change& change = {}) const {
    ObjectEvaluator evaluator;
    for (int i = 0; i < kNumFrames; ++i) {
      Frame frame = frameAt(i);
      if (change) {
        change(i, &frame);
      }
      ObjectFrame reported;
      reported.stamp = frame.truth.stamp;
      reported.odom_from_vehicle = odom_from_world_ * frame.truth.world_from_vehicle;
      for (const TrackedObject& report : frame.reports) {
        reported.objects.push_back(transformed(report, odom_from_world_));
      }
      evaluator.add(frame.truth, reported);
    }
    return evaluator.errors();
  }

  const RigidTransform odom_from_world_;
};

}  // namespace vcharge
