#include "vcharge_obstacles/step_mapper.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <Eigen/Cholesky>

#include "steps/step_finder.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Matching windows overlap, so that the points of one cell have about this number of independent errors.
constexpr int kIndependentPoints = 3;
// Error that all points of a range map in one cell have in common, after levelling.
constexpr float kCommonSigma_m = 0.01F;
// The mean of a cell is never known better, so that it follows the odometry's drift.
constexpr float kLeastSigma_m = 0.003F;
// A range map is levelled on at least this number of cells that are known this well.
constexpr size_t kMinLevelCells = 300;
constexpr float kLevelSigma_m = 0.015F;
constexpr double kLevelKernel_m = 0.02;
constexpr int kLevelIterations = 3;
// Cells that are known less well have no height yet.
constexpr float kKnownSigma_m = 0.02F;
// Fraction of the difference to the map that is left in each range map. It brings the map back to the plane
// of the ground: each levelling alone would add to a drift.
constexpr double kLeak = 0.1;
// Standard deviations of the errors that levelling corrects, in height and slope.
constexpr double kOffsetSigma_m = 0.02;
constexpr double kSlopeSigma = 0.01;
// A cell is known after this number of range maps. Its height follows most of them: observations further off
// than this number of standard deviations weigh less.
constexpr int kMinObservations = 8;
constexpr float kGateSigmas = 2.0F;
constexpr float kScatterMemory = 0.9F;
// Errors of successive range maps are alike: as many have independent errors, however many there are.
constexpr float kIndependentMaps = 8.0F;

constexpr float squared(float value) {
  return value * value;
}

RigidTransform levelled(const RigidTransform& transform) {
  return RigidTransform::planar(transform.translation().x(), transform.translation().y(),
                                yawOfRotation(transform.rotation()));
}

int windowCells(const VehicleOutline& outline) {
  const double half_m =
      std::hypot(0.5 * (outline.front_m - outline.rear_m), outline.half_width_m) + StepMapper::kReach_m;
  return 2 * static_cast<int>(std::ceil(half_m / StepMapper::kCell_m));
}

}  // namespace

StepMapper::StepMapper(const VehicleOutline& outline, const StepMapperOptions& options)
    : outline_(outline), options_((options.validate(), options)), cells_(windowCells(outline), kCell_m) {}

void StepMapper::moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle) {
  stamp_ = stamp;
  fixed_from_vehicle_ = levelled(fixed_from_vehicle);
  has_pose_ = true;
  const Eigen::Vector3d middle_m =
      fixed_from_vehicle_ * Eigen::Vector3d(0.5 * (outline_.front_m + outline_.rear_m), 0.0, 0.0);
  cells_.moveTo(cells_.indexOf(middle_m.x()) - cells_.size() / 2,
                cells_.indexOf(middle_m.y()) - cells_.size() / 2);
}

/// Sums of the points per cell, in the order of their first points.
std::vector<StepMapper::Sum> StepMapper::collect(const HeightPoints& points) const {
  std::vector<Sum> sums;
  std::vector<int32_t> sum_of_cell(static_cast<size_t>(cells_.size()) * static_cast<size_t>(cells_.size()),
                                   -1);
  const double cosine = fixed_from_vehicle_.rotationMatrix()(0, 0);
  const double sine = fixed_from_vehicle_.rotationMatrix()(1, 0);
  const Eigen::Vector3d origin = fixed_from_vehicle_.translation();
  for (const HeightPoint& point : points) {
    const int64_t x = cells_.indexOf(origin.x() + cosine * point.x_m - sine * point.y_m);
    const int64_t y = cells_.indexOf(origin.y() + sine * point.x_m + cosine * point.y_m);
    if (!cells_.isInside(x, y)) {
      continue;
    }
    int32_t& index = sum_of_cell[static_cast<size_t>(y - cells_.firstY()) * cells_.size() +
                                 static_cast<size_t>(x - cells_.firstX())];
    if (index < 0) {
      index = static_cast<int32_t>(sums.size());
      sums.push_back({x, y});
    }
    Sum& sum = sums[static_cast<size_t>(index)];
    const float weight = 1.0F / (point.variance_m2 + squared(kCommonSigma_m));
    sum.weight += weight;
    sum.weighted_height += weight * point.height_m;
    ++sum.count;
  }
  return sums;
}

/// Height (at the vehicle's origin) and slopes in the fixed frame by which the sums lie above the map.
Eigen::Vector3d StepMapper::levelOn(const std::vector<Sum>& sums) const {
  struct Pair {
    Eigen::Vector3d row;
    double difference_m;
  };
  std::vector<Pair> pairs;
  const Eigen::Vector3d origin = fixed_from_vehicle_.translation();
  for (const Sum& sum : sums) {
    const Cell& cell = cells_.at(sum.x, sum.y);
    if (cell.weight * squared(kLevelSigma_m) >= 1.0F) {
      pairs.push_back({{1.0, static_cast<double>(sum.x) * kCell_m - origin.x(),
                        static_cast<double>(sum.y) * kCell_m - origin.y()},
                       static_cast<double>(sum.height_m() - cell.height_m)});
    }
  }
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
  if (pairs.size() < kMinLevelCells) {
    return plane;
  }
  const double slope_information = 1.0 / (kSlopeSigma * kSlopeSigma);
  for (int i = 0; i < kLevelIterations; ++i) {
    Eigen::Matrix3d information =
        Eigen::Vector3d(1.0 / (kOffsetSigma_m * kOffsetSigma_m), slope_information, slope_information)
            .asDiagonal();
    Eigen::Vector3d vector = Eigen::Vector3d::Zero();
    for (const Pair& pair : pairs) {
      const double error = (pair.difference_m - pair.row.dot(plane)) / kLevelKernel_m;
      const double weight = 1.0 / (kLevelKernel_m * kLevelKernel_m * (1.0 + error * error));
      information.noalias() += weight * pair.row * pair.row.transpose();
      vector += weight * pair.difference_m * pair.row;
    }
    plane = information.ldlt().solve(vector);
  }
  return (1.0 - kLeak) * plane;
}

void StepMapper::add(const HeightPoints& points) {
  check(has_pose_, "StepMapper::add: expected moveTo() before");
  const std::vector<Sum> sums = collect(points);
  const Eigen::Vector3d plane = levelOn(sums);
  const Eigen::Vector3d origin = fixed_from_vehicle_.translation();
  constexpr float kMaxWeight = 1.0F / (kLeastSigma_m * kLeastSigma_m);
  for (const Sum& sum : sums) {
    const double correction_m =
        plane.dot(Eigen::Vector3d(1.0, static_cast<double>(sum.x) * kCell_m - origin.x(),
                                  static_cast<double>(sum.y) * kCell_m - origin.y()));
    const float height_m = sum.height_m() - static_cast<float>(correction_m);
    const float variance = static_cast<float>(sum.count) / sum.weight /
                               static_cast<float>(std::min(sum.count, kIndependentPoints)) +
                           squared(kCommonSigma_m);
    Cell& cell = cells_.at(sum.x, sum.y);
    const float difference_m = height_m - cell.height_m;
    // A cell that changed is followed by and by, since its scatter grows with the differences.
    const float gate = 1.0F + squared(difference_m) / (squared(kGateSigmas) * (variance + cell.scatter));
    const float weight = cell.observations > 0 ? 1.0F / (variance * gate) : 1.0F / variance;
    cell.height_m += weight / (cell.weight + weight) * difference_m;
    cell.weight = std::min(cell.weight + weight, kMaxWeight);
    if (cell.observations > 0) {
      const float memory = std::min(kScatterMemory, 1.0F - 1.0F / static_cast<float>(cell.observations));
      cell.scatter = memory * cell.scatter + (1.0F - memory) * squared(difference_m);
    }
    ++cell.observations;
  }
}

void StepMapper::reanchor(const RigidTransform& new_from_old_fixed) {
  if (!has_pose_) {
    return;
  }
  const RigidTransform new_from_old = levelled(new_from_old_fixed);
  const RigidTransform old_from_new = new_from_old.inverse();
  StepMapper moved(outline_, options_);
  moved.moveTo(stamp_, new_from_old * fixed_from_vehicle_);
  const double cell_m = kCell_m;
  moved.cells_.forEach([&](int64_t x, int64_t y, const Cell& /*unset*/) {
    const Eigen::Vector3d point_m =
        old_from_new * Eigen::Vector3d((static_cast<double>(x) + 0.5) * cell_m,
                                       (static_cast<double>(y) + 0.5) * cell_m, 0.0);
    const int64_t old_x = cells_.indexOf(point_m.x());
    const int64_t old_y = cells_.indexOf(point_m.y());
    if (cells_.isInside(old_x, old_y)) {
      moved.cells_.at(x, y) = cells_.at(old_x, old_y);
    }
  });
  *this = std::move(moved);
}

StepMap StepMapper::snapshot() const {
  StepMap map = StepMap::unknown({cells_.size(), cells_.size()}, kCell_m);
  map.stamp = stamp_;
  map.fixed_from_vehicle = fixed_from_vehicle_;
  map.origin_m =
      kCell_m * Eigen::Vector2d(static_cast<double>(cells_.firstX()), static_cast<double>(cells_.firstY()));
  cells_.forEach([&](int64_t x, int64_t y, const Cell& cell) {
    const float variance = 1.0F / cell.weight + cell.scatter / kIndependentMaps;
    if (cell.observations >= kMinObservations && variance <= squared(kKnownSigma_m)) {
      const auto row = static_cast<int>(y - cells_.firstY());
      const auto column = static_cast<int>(x - cells_.firstX());
      map.ground_m.at<float>(row, column) = cell.height_m;
      map.sigma_m.at<float>(row, column) = std::sqrt(variance);
    }
  });
  findSteps(options_, &map);
  return map;
}

}  // namespace vcharge
