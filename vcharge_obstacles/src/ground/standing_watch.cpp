#include "ground/standing_watch.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Below this speed and yaw rate, the vehicle stands.
constexpr double kStanding_m_per_s = 0.02;
constexpr double kStanding_rad_per_s = 0.01;
// Time between two images that are compared.
constexpr double kInterval_s = 0.2;
// Images that wait for the odometry, per camera.
constexpr size_t kMaxWaiting = 25;
// Fraction of the pixels of a cell and its neighbours from which its ground has changed, or has not.
constexpr double kMinChangedFraction = 0.4, kMinSameFraction = 0.4;
// Nothing is told by an older image.
constexpr double kMaxAge_s = 1.0;
// Distance at which changes are told apart.
constexpr double kStep_m = 0.1;

/// Mean fraction of a cell and its neighbours: alone, distant cells have few pixels.
double fractionAround(const PolarGrid& grid, const std::vector<float>& fraction, int ray, int bin) {
  double sum = 0.0;
  int count = 0;
  for (int r = ray - 1; r <= ray + 1; ++r) {
    for (int b = std::max(0, bin - 1); b <= std::min(grid.numBins() - 1, bin + 1); ++b) {
      sum += fraction[grid.index(grid.wrap(r), b)];
      ++count;
    }
  }
  return sum / count;
}

}  // namespace

struct StandingWatch::Camera {
  struct Image {
    Timestamp stamp;
    Pixels pixels;
  };
  /// What an image at rest shows of the first one.
  struct Comparison {
    Timestamp stamp, first;
    std::vector<float> same_fraction;
  };
  Camera(const WorkingCamera& camera, const RigCamera& rig_camera, const PolarGrid& grid,
         double max_distance_m, const GroundWatchOptions& options)
      : working(camera),
        vehicle_from_camera(*rig_camera.vehicle_from_camera),
        watch(camera, vehicle_from_camera, grid, max_distance_m, options) {}

  void startOver() {
    watch.clear();
    last_compared.reset();
    comparisons.clear();
  }
  /// Whether most of the ground at a point in the vehicle frame looks as it did at first.
  bool isSame(const Comparison& comparison, const PolarGrid& grid, const Eigen::Vector2d& point_m) const {
    const Eigen::Vector2d offset_m = point_m - vehicle_from_camera.translation().head<2>();
    const double range_m = offset_m.norm();
    const int bin = range_m > 0.0 ? grid.binOfInverse(static_cast<float>(1.0 / range_m)) : -1;
    return bin >= 0 && bin < grid.numBins() &&
           fractionAround(grid, comparison.same_fraction, grid.rayOf(std::atan2(offset_m.y(), offset_m.x())),
                          bin) >= kMinSameFraction;
  }

  const WorkingCamera working;
  const RigidTransform vehicle_from_camera;
  GroundWatch watch;
  std::deque<Image> waiting;
  std::optional<Timestamp> last_compared;
  std::deque<Comparison> comparisons;
};

StandingWatch::StandingWatch(std::shared_ptr<const CameraRig> rig, const PolarGrid& grid,
                             double max_distance_m, const GroundWatchOptions& options)
    : rig_(std::move(rig)),
      grid_(grid),
      max_distance_m_(max_distance_m),
      options_(options),
      cameras_(rig_->cameras.size()) {}

StandingWatch::~StandingWatch() = default;

void StandingWatch::setCamera(size_t camera, const WorkingCamera& working) {
  cameras_.at(camera) =
      std::make_unique<Camera>(working, rig_->cameras[camera], grid_, max_distance_m_, options_);
}

void StandingWatch::addImage(size_t camera, Timestamp stamp, const Pixels& pixels) {
  Camera* watched = cameras_.at(camera).get();
  if (watched == nullptr || (!watched->waiting.empty() && stamp <= watched->waiting.back().stamp)) {
    return;
  }
  watched->waiting.push_back({stamp, pixels});
  if (watched->waiting.size() > kMaxWaiting) {
    watched->waiting.pop_front();
  }
}

void StandingWatch::settle(Timestamp until, const OdometryAt& odometry_at) {
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    for (; camera && !camera->waiting.empty() && camera->waiting.front().stamp <= until;
         camera->waiting.pop_front()) {
      const Camera::Image& image = camera->waiting.front();
      const std::optional<VehicleOdometry> odometry = odometry_at(image.stamp);
      if (!odometry || std::abs(odometry->forward_speed_m_per_s) > kStanding_m_per_s ||
          std::abs(odometry->yaw_rate_rad_per_s) > kStanding_rad_per_s) {
        camera->startOver();
      } else if (!camera->last_compared || toSeconds(image.stamp - *camera->last_compared) >= kInterval_s) {
        compare(camera.get(), image.stamp, image.pixels(), odometry->odom_from_vehicle);
      }
    }
  }
}

void StandingWatch::compare(Camera* camera, Timestamp stamp, const cv::Mat& pixels,
                            const RigidTransform& odom_from_vehicle) {
  camera->last_compared = stamp;
  StandingAppearance appearance = camera->watch.compareStanding(stamp, camera->working.undistort(pixels));
  if (!appearance.same_fraction.empty()) {
    camera->comparisons.push_back({stamp, appearance.first, std::move(appearance.same_fraction)});
  }
  const std::vector<float>& fraction = appearance.changed_fraction;
  if (fraction.empty()) {
    return;
  }
  const Eigen::Vector3d& camera_m = camera->vehicle_from_camera.translation();
  for (int ray = 0; ray < grid_.numRays(); ++ray) {
    for (int bin = 0; bin < grid_.numBins(); ++bin) {
      if (fraction[grid_.index(ray, bin)] <= 0.0F ||
          fractionAround(grid_, fraction, ray, bin) < kMinChangedFraction) {
        continue;
      }
      const double angle_rad = grid_.angle_rad(ray);
      const Eigen::Vector3d point_m =
          odom_from_vehicle * Eigen::Vector3d(camera_m.x() + grid_.range_m(bin) * std::cos(angle_rad),
                                              camera_m.y() + grid_.range_m(bin) * std::sin(angle_rad), 0.0);
      Change& change =
          changes_
              .try_emplace({std::llround(point_m.x() / kStep_m), std::llround(point_m.y() / kStep_m)},
                           Change{stamp, stamp})
              .first->second;
      change.first = std::min(change.first, stamp);
      change.last = std::max(change.last, stamp);
    }
  }
}

void StandingWatch::apply(Timestamp until, const RigidTransform& fixed_from_odom,
                          LocalObstacleMap* map) const {
  forgetChanged(until, fixed_from_odom, map);
  restoreUnchanged(until, map);
}

void StandingWatch::forgetChanged(Timestamp until, const RigidTransform& fixed_from_odom,
                                  LocalObstacleMap* map) const {
  for (const auto& [key, change] : changes_) {
    if (change.first <= until) {
      const Eigen::Vector3d point_m =
          fixed_from_odom * Eigen::Vector3d(kStep_m * static_cast<double>(key.first),
                                            kStep_m * static_cast<double>(key.second), 0.0);
      map->forgetAround(point_m.head<2>(), change.first, std::min(until, change.last));
    }
  }
}

void StandingWatch::restoreUnchanged(Timestamp until, LocalObstacleMap* map) const {
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    const Camera::Comparison* newest = nullptr;
    for (size_t i = 0; camera && i < camera->comparisons.size() && camera->comparisons[i].stamp <= until;
         ++i) {
      newest = &camera->comparisons[i];
    }
    if (newest != nullptr && toSeconds(until - newest->stamp) <= kMaxAge_s) {
      map->restoreFree(newest->first, until, [&](const Eigen::Vector2d& point_m) {
        return camera->isSame(*newest, grid_, point_m);
      });
    }
  }
}

void StandingWatch::dropChanges(Timestamp until) {
  for (auto change = changes_.begin(); change != changes_.end();) {
    change = change->second.last <= until ? changes_.erase(change) : std::next(change);
  }
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    while (camera && camera->comparisons.size() > 1 && camera->comparisons[1].stamp <= until) {
      camera->comparisons.pop_front();
    }
  }
}

void StandingWatch::clear() {
  changes_.clear();
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      camera->startOver();
      camera->waiting.clear();
    }
  }
}

}  // namespace vcharge
