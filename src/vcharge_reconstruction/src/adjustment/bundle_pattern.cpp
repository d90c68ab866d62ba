// Construction of BundleEquations: its slots and the sparsity pattern of its reduced system.
#include <algorithm>
#include <set>

#include <tbb/parallel_for.h>

#include "adjustment/bundle_equations.h"

namespace vcharge {

void BundleEquations::makeSlots() {
  slots_of_pose_.resize(problem_.map_from_vehicle.size());
  slots_.reserve(problem_.observations.size() + problem_.ground_observations.size());  // at most
  auto ground = problem_.ground_observations.begin();
  const auto addSlot = [&](size_t point, int32_t pose, bool is_ground, size_t begin) {
    slots_of_pose_[pose].push_back(slots_.size());
    Slot slot;
    slot.pose = pose;
    slot.point = static_cast<int32_t>(point);
    slot.is_ground = is_ground;
    slot.begin = begin;
    slot.end = begin + 1;
    slots_.push_back(slot);
  };
  // Slots of a point are ordered by pose.
  const auto addGround = [&](size_t point, int32_t last_pose) {
    for (; ground != problem_.ground_observations.end() && ground->point == static_cast<int32_t>(point) &&
           ground->pose <= last_pose;
         ++ground) {
      addSlot(point, ground->pose, true, static_cast<size_t>(ground - problem_.ground_observations.begin()));
    }
  };
  for (size_t point = 0; point < points_.size(); ++point) {
    first_slot_of_point_.push_back(slots_.size());
    for (size_t i = problem_.first_observation[point]; i < problem_.first_observation[point + 1]; ++i) {
      const BundleObservation& observation = problem_.observations[i];
      addGround(point, observation.pose);
      const bool is_first = slots_.size() == first_slot_of_point_.back();
      if (is_first || slots_.back().is_ground || slots_.back().pose != observation.pose ||
          (hasCameras() && slots_.back().camera != observation.camera) || hasOwnDerivatives(observation)) {
        addSlot(point, observation.pose, false, i);
        slots_.back().camera = observation.camera;
      } else {
        ++slots_.back().end;
      }
    }
    addGround(point, static_cast<int32_t>(problem_.map_from_vehicle.size()));
  }
  first_slot_of_point_.push_back(slots_.size());
}

void BundleEquations::makeCameraTerms() {
  if (hasCameras()) {
    camera_slots_.assign(slots_.size(), {Matrix3Cd::Zero(3, cameraSize()), MatrixC3d::Zero(cameraSize(), 3)});
  }
  first_camera_of_point_.push_back(0);
  for (size_t point = 0; point < points_.size(); ++point) {
    std::set<int32_t> seen;
    for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
      if (hasCamera(slots_[s])) {
        seen.insert(slots_[s].camera);
      }
    }
    for (const int32_t camera : seen) {
      cameras_.emplace_back().camera = camera;
    }
    first_camera_of_point_.push_back(cameras_.size());
  }
}

void BundleEquations::makePattern() {
  const size_t num_poses = slots_of_pose_.size();
  rows_of_pose_.resize(num_poses);
  tbb::parallel_for(firstFreePose(), num_poses, [&](size_t pose) {
    std::vector<bool> is_row(pose + 1, false);
    is_row[pose] = true;
    if (pose > firstFreePose()) {
      is_row[pose - 1] = true;  // odometer factor
    }
    for (const size_t s : slots_of_pose_[pose]) {
      for (size_t other = first_slot_of_point_[slots_[s].point]; other < s; ++other) {
        is_row[slots_[other].pose] = true;
      }
    }
    for (size_t other = firstFreePose(); other <= pose; ++other) {
      if (is_row[other]) {
        rows_of_pose_[pose].push_back(static_cast<int32_t>(other));
      }
    }
  });
  std::vector<int> starts{0};
  for (size_t pose = firstFreePose(); pose < num_poses; ++pose) {
    for (int i = 1; i <= 6; ++i) {
      starts.push_back(starts.back() + 6 * static_cast<int>(rows_of_pose_[pose].size() - 1) + i);
    }
  }
  for (int i = 1; i <= tailSize(); ++i) {
    starts.push_back(starts.back() + static_cast<int>(tailColumn()) + i);
  }
  reduced_.resize(tailColumn() + tailSize(), tailColumn() + tailSize());
  reduced_.resizeNonZeros(starts.back());
  std::copy(starts.begin(), starts.end(), reduced_.outerIndexPtr());
  int* inner = reduced_.innerIndexPtr();
  for (size_t pose = firstFreePose(); pose < num_poses; ++pose) {
    for (int i = 0; i < 6; ++i) {
      for (const int32_t row : rows_of_pose_[pose]) {
        const int num_rows = static_cast<size_t>(row) == pose ? i + 1 : 6;
        for (int k = 0; k < num_rows; ++k) {
          *inner++ = static_cast<int>(columnOf(row)) + k;
        }
      }
    }
  }
  for (int i = 0; i < tailSize(); ++i) {
    for (int k = 0; k <= tailColumn() + i; ++k) {
      *inner++ = k;
    }
  }
  factorization_.analyzePattern(reduced_);
}

}  // namespace vcharge
