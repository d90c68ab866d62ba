#include "range_mapping/motion_refinement.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include <tbb/parallel_for.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

#include "vcharge_features/patch_tracker.h"

namespace vcharge {
namespace {

constexpr int kMaxPointsPerCamera = 120;
constexpr double kCornerQuality = 0.01, kCornerDistance_px = 12.0;
// New corners are searched once fewer than this fraction of the points are left.
constexpr double kRefillBelow = 0.8;
constexpr double kTrackNoise_px = 0.15;  // from one image to the next
constexpr int kMinPoints = 30;
// Initial position of a new point: where one at this inverse range would be.
constexpr double kInitialInverseRange_per_m = 0.15;
// Rays closer to the direction of travel (sine of the angle) do not determine an epipolar plane.
constexpr double kMinSine = 0.1;
constexpr int kMaxSteps = 15;
constexpr double kConverged = 0.02;     // largest remaining step, in standard deviations
constexpr double kMaxDeviations = 8.0;  // largest correction per axis, in standard deviations

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

PatchTrackerOptions trackerOptions() {
  PatchTrackerOptions options;
  options.window_px = 15;
  options.num_levels = 2;
  options.max_iterations = 20;
  return options;
}

/// Applies a correction: rotation vector and translation in the neighbour's frame.
RigidTransform corrected(const RigidTransform& pose, const Vector6& correction) {
  return RigidTransform(rotationFromVector(correction.head<3>()) * pose.rotation(),
                        pose.translation() + correction.tail<3>());
}

/// A point as a camera saw it, in the vehicle's frame at the image's stamp.
struct Sight {
  Eigen::Vector3d ray;         // unit
  Eigen::Vector3d position_m;  // of the camera when it exposed the point
};

/// A followed point in two frames.
struct PointPair {
  Sight from, to;
  double steps;  // images over which it was followed from one to the other
};

/// The points of one camera in two frames.
struct CameraPairs {
  double noise_rad;
  std::vector<PointPair> points;
};

/// Equations of the points for a correction of the motion.
struct Equations {
  Matrix6 hessian = Matrix6::Identity();
  Vector6 gradient = Vector6::Zero();
  int agreeing = 0;

  /// The sine of a point's angle to its epipolar plane, and its derivatives by rotation and translation.
  void add(const RigidTransform& neighbour_from_reference, const CameraPairs& camera, const Vector6& sigma) {
    const Eigen::Matrix3d rotation = neighbour_from_reference.rotationMatrix();
    for (const PointPair& point : camera.points) {
      const Eigen::Vector3d arm = rotation * point.from.position_m;
      const Eigen::Vector3d baseline = arm + neighbour_from_reference.translation() - point.to.position_m;
      const Eigen::Vector3d ray = rotation * point.from.ray;
      const Eigen::Vector3d normal = baseline.cross(ray);
      const double length = normal.norm();
      if (!(length > kMinSine * baseline.norm())) {
        continue;
      }
      const double error = point.to.ray.dot(normal) / length;
      const Eigen::Vector3d by_normal = (point.to.ray - error * normal / length) / length;
      const Eigen::Vector3d by_baseline = ray.cross(by_normal);
      Vector6 slope;
      slope << arm.cross(by_baseline) + ray.cross(by_normal.cross(baseline)), by_baseline;
      const double noise_rad = camera.noise_rad * std::sqrt(point.steps);
      slope = slope.cwiseProduct(sigma) / noise_rad;
      const double scaled = error / noise_rad;
      const double weight = 1.0 / (1.0 + 0.25 * scaled * scaled);
      agreeing += weight > 0.5 ? 1 : 0;
      hessian += weight * slope * slope.transpose();
      gradient += weight * scaled * slope;
    }
  }
};

}  // namespace

/// Follows the points of one camera from image to image.
class MotionRefinement::FollowedCamera {
 public:
  explicit FollowedCamera(const Camera& camera) : camera_(camera), tracker_(trackerOptions()) {}

  void add(Timestamp stamp, const cv::Mat& image, const RigidTransform& odom_from_vehicle,
           const ImageMotion& motion) {
    motion_ = motion;
    const RigidTransform odom_from_camera = odom_from_vehicle * camera_.vehicle_from_camera;
    ImagePyramid pyramid = tracker_.buildPyramid(image);
    follow(stamp, pyramid, odom_from_camera.inverse() * odom_from_camera_);
    if (static_cast<double>(points_.size()) < kRefillBelow * kMaxPointsPerCamera) {
      startPoints(stamp, image);
    }
    pyramid_ = std::move(pyramid);
    odom_from_camera_ = odom_from_camera;
  }

  void forgetBefore(Timestamp stamp) {
    for (Point& point : points_) {
      while (point.observations.size() > 1 && point.observations.front().stamp < stamp) {
        point.observations.pop_front();
      }
    }
    while (!lost_.empty() && lost_.front().observations.back().stamp < stamp) {
      lost_.pop_front();
    }
  }

  void clear() {
    points_.clear();
    lost_.clear();
    pyramid_ = ImagePyramid();
  }

  CameraPairs pairs(Timestamp neighbour, Timestamp reference) const {
    // Angle of a pixel in the middle of the image, where the unified camera has its highest resolution.
    CameraPairs result{kTrackNoise_px * (1.0 + camera_.model.xi()) / camera_.model.gamma1(), {}};
    const auto add = [&](const Point& point) {
      const std::optional<size_t> from = point.at(reference), to = point.at(neighbour);
      if (from && to) {
        result.points.push_back({point.observations[*from].sight, point.observations[*to].sight,
                                 std::abs(static_cast<double>(*from) - static_cast<double>(*to))});
      }
    };
    std::for_each(lost_.begin(), lost_.end(), add);
    std::for_each(points_.begin(), points_.end(), add);
    return result;
  }

 private:
  struct Observation {
    Timestamp stamp;
    Sight sight;
  };
  struct Point {
    cv::Point2f position_px;     // in the last image
    double inverse_range_per_m;  // in the last image, for the prediction
    std::deque<Observation> observations;

    /// Index of the observation at a stamp.
    std::optional<size_t> at(Timestamp stamp) const {
      const auto found = std::lower_bound(observations.begin(), observations.end(), stamp,
                                          [](const Observation& a, Timestamp b) { return a.stamp < b; });
      return found != observations.end() && found->stamp == stamp
                 ? std::optional<size_t>(found - observations.begin())
                 : std::nullopt;
    }
  };

  bool rayOf(const cv::Point2f& position_px, Eigen::Vector3d* ray_in_camera) const {
    return camera_.model.unproject({position_px.x, position_px.y}, ray_in_camera);
  }
  /// What the last image shows at a position.
  Sight sightOf(const cv::Point2f& position_px, const Eigen::Vector3d& ray_in_camera) const {
    const double time_s =
        motion_.offset_s + camera_.times.at(imagePoint(camera_.model, {position_px.x, position_px.y}));
    const RigidTransform& camera = camera_.vehicle_from_camera;
    const Sight at_exposure{camera.rotation() * ray_in_camera.normalized(), camera.translation()};
    if (time_s == 0.0) {
      return at_exposure;
    }
    const RigidTransform stamp_from_exposure = motion_.rates.motionAfter(time_s);
    return {stamp_from_exposure.rotation() * at_exposure.ray, stamp_from_exposure * at_exposure.position_m};
  }

  /// Inverse range along `ray` of a point seen along `before` earlier; within the bounds of what is useful.
  static double inverseRange(const RigidTransform& now_from_before, const Eigen::Vector3d& before,
                             const Eigen::Vector3d& ray) {
    // ray is parallel to R before + t / range.
    const Eigen::Vector3d moved = ray.cross(now_from_before.translation());
    const Eigen::Vector3d turned = ray.cross(now_from_before.rotation() * before);
    const double squared = moved.squaredNorm();
    return squared > 1e-8 ? std::clamp(-moved.dot(turned) / squared, 0.0, 2.0) : kInitialInverseRange_per_m;
  }

  void follow(Timestamp stamp, const ImagePyramid& pyramid, const RigidTransform& now_from_before) {
    if (points_.empty()) {
      return;
    }
    std::vector<cv::Point2f> from, predicted;
    std::vector<Eigen::Vector3d> rays(points_.size());
    for (size_t i = 0; i < points_.size(); ++i) {
      const Point& point = points_[i];
      Eigen::Vector2d expected;
      from.push_back(point.position_px);
      rayOf(point.position_px, &rays[i]);
      const bool is_seen =
          camera_.model.project(now_from_before.rotation() * rays[i].normalized() +
                                    point.inverse_range_per_m * now_from_before.translation(),
                                &expected);
      predicted.push_back(
          is_seen ? cv::Point2f(static_cast<float>(expected.x()), static_cast<float>(expected.y()))
                  : point.position_px);
    }
    const std::vector<TrackedPoint> found =
        tracker_.track(pyramid_, pyramid, from, camera_.valid_mask, predicted);
    std::vector<Point> kept;
    for (size_t i = 0; i < points_.size(); ++i) {
      Eigen::Vector3d ray;
      if (found[i].status == TrackStatus::kTracked && rayOf(found[i].position_px, &ray)) {
        points_[i].position_px = found[i].position_px;
        points_[i].inverse_range_per_m =
            inverseRange(now_from_before, rays[i].normalized(), ray.normalized());
        points_[i].observations.push_back({stamp, sightOf(found[i].position_px, ray)});
        kept.push_back(std::move(points_[i]));
      } else if (points_[i].observations.size() > 1) {
        lost_.push_back(std::move(points_[i]));
      }
    }
    points_ = std::move(kept);
  }

  void startPoints(Timestamp stamp, const cv::Mat& image) {
    cv::Mat is_free = camera_.valid_mask.clone();
    for (const Point& point : points_) {
      cv::circle(is_free, point.position_px, cvRound(kCornerDistance_px), cv::Scalar(0), cv::FILLED);
    }
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(image, corners, kMaxPointsPerCamera - static_cast<int>(points_.size()),
                            kCornerQuality, kCornerDistance_px, is_free);
    for (const cv::Point2f& corner : corners) {
      Eigen::Vector3d ray;
      if (rayOf(corner, &ray)) {
        points_.push_back({corner, kInitialInverseRange_per_m, {{stamp, sightOf(corner, ray)}}});
      }
    }
  }

  const Camera camera_;
  const PatchTracker tracker_;
  ImagePyramid pyramid_;             // the last image
  RigidTransform odom_from_camera_;  // at the last image
  ImageMotion motion_;               // at the last image
  std::vector<Point> points_;        // in the last image
  std::deque<Point> lost_;           // not in it, in the order in which they were lost
};

MotionRefinement::MotionRefinement(const std::vector<std::optional<Camera>>& cameras,
                                   const PoseNoiseOptions& noise)
    : noise_(noise) {
  for (const std::optional<Camera>& camera : cameras) {
    cameras_.push_back(camera ? std::make_unique<FollowedCamera>(*camera) : nullptr);
  }
}

MotionRefinement::~MotionRefinement() = default;

void MotionRefinement::addFrame(Timestamp stamp, const std::vector<cv::Mat>& images,
                                const RigidTransform& odom_from_vehicle, const FrameMotion& motion) {
  tbb::parallel_for(size_t{0}, cameras_.size(), [&](size_t i) {
    if (cameras_[i] && !images[i].empty()) {
      cameras_[i]->add(stamp, images[i], odom_from_vehicle, motion.of(i));
    }
  });
}

void MotionRefinement::forgetBefore(Timestamp stamp) {
  for (const std::unique_ptr<FollowedCamera>& camera : cameras_) {
    if (camera) {
      camera->forgetBefore(stamp);
    }
  }
}

void MotionRefinement::clear() {
  for (const std::unique_ptr<FollowedCamera>& camera : cameras_) {
    if (camera) {
      camera->clear();
    }
  }
}

MotionRefinement::Result MotionRefinement::refine(Timestamp neighbour, Timestamp reference,
                                                  const RigidTransform& neighbour_from_reference) const {
  Result result;
  result.neighbour_from_reference = neighbour_from_reference;
  const double baseline_m = neighbour_from_reference.translation().norm();
  std::vector<CameraPairs> cameras;
  for (const std::unique_ptr<FollowedCamera>& camera : cameras_) {
    if (camera) {
      cameras.push_back(camera->pairs(neighbour, reference));
      result.num_points += static_cast<int>(cameras.back().points.size());
    }
  }
  if (result.num_points < kMinPoints) {
    return result;
  }
  Vector6 sigma;
  sigma << Eigen::Vector3d::Constant(std::sqrt(noise_.rotationVariance_rad2(baseline_m))),
      Eigen::Vector3d::Constant(std::sqrt(noise_.translationVariance_m2(baseline_m)));
  // Gauss-Newton with Cauchy weights; the unknowns are in units of the motion's standard deviations.
  Vector6 x = Vector6::Zero();
  Equations equations;
  bool converged = false;
  for (int step = 0; step < kMaxSteps && !converged; ++step) {
    equations = Equations();
    equations.gradient = x;
    const RigidTransform motion = corrected(neighbour_from_reference, x.cwiseProduct(sigma));
    for (const CameraPairs& camera : cameras) {
      equations.add(motion, camera, sigma);
    }
    const Vector6 change = -equations.hessian.ldlt().solve(equations.gradient);
    x += change;
    converged = change.cwiseAbs().maxCoeff() < kConverged;
  }
  if (converged && 2 * equations.agreeing >= result.num_points && equations.agreeing >= kMinPoints &&
      x.cwiseAbs().maxCoeff() <= kMaxDeviations) {
    result.neighbour_from_reference = corrected(neighbour_from_reference, x.cwiseProduct(sigma));
    result.is_refined = true;
    const Matrix6 variance_left = equations.hessian.inverse();
    const Eigen::Vector3d along = result.neighbour_from_reference.translation().normalized();
    result.rotation_variance_left = variance_left.topLeftCorner<3, 3>().trace() / 3.0;
    result.translation_variance_left = along.dot(variance_left.bottomRightCorner<3, 3>() * along);
  }
  return result;
}

SweepImage MotionRefinement::refined(const SweepImage& neighbour, const SweepImage& reference,
                                     const RigidTransform& vehicle_from_camera) const {
  const RigidTransform camera_from_vehicle = vehicle_from_camera.inverse();
  const RigidTransform neighbour_from_reference =
      (neighbour.world_from_camera * camera_from_vehicle).inverse() *
      (reference.world_from_camera * camera_from_vehicle);
  const Result motion = refine(neighbour.stamp, reference.stamp, neighbour_from_reference);
  SweepImage result = neighbour;
  if (motion.is_refined) {
    result.world_from_camera = reference.world_from_camera * camera_from_vehicle *
                               motion.neighbour_from_reference.inverse() * vehicle_from_camera;
    result.noise.rotation_left = motion.rotation_variance_left;
    result.noise.translation_left = motion.translation_variance_left;
  }
  return result;
}

}  // namespace vcharge
