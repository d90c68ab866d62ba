#include "vcharge_features/rectified_view.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;
/// Cameras whose axes differ by more have no common view.
constexpr double kMaxAxisAngle_rad = 2.4;

PinholeCamera makePinhole(const RectifiedViewOptions& options) {
  options.validate();
  const double focal_px = 0.5 * options.width_px / std::tan(0.5 * options.horizontal_field_of_view_rad);
  return PinholeCamera(PinholeCamera::Parameters((PinholeCamera::Parameters() << focal_px, focal_px,
                                                  0.5 * (options.width_px - 1), 0.5 * (options.height_px - 1),
                                                  Eigen::VectorXd::Zero(PinholeCamera::kNumParameters - 4))
                                                     .finished()));
}

bool isInside(const Eigen::Vector2d& pixel, cv::Size size) {
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= size.width - 1 && pixel.y() <= size.height - 1;
}

}  // namespace

RectifiedView::RectifiedView(const RigCamera& camera, const Eigen::Quaterniond& view_from_camera,
                             const RectifiedViewOptions& options)
    : camera_(camera.model),
      sensor_size_px_(camera.image_size_px),
      min_cos_angle_(std::cos(0.5 * camera.field_of_view_rad)),
      view_from_camera_(view_from_camera.normalized()),
      model_(makePinhole(options)),
      valid_mask_(cv::Mat::zeros(options.height_px, options.width_px, CV_8UC1)) {
  // Pixels without a sensor pixel map outside the image, where remap() writes 0.
  cv::Mat map(valid_mask_.size(), CV_32FC2, cv::Scalar(-10.0, -10.0));
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      valid_mask_.at<uint8_t>(y, x) = 255;
      Eigen::Vector2d pixel;
      const bool valid =
          toSensor(Eigen::Vector2d(x, y), &pixel) &&
          (camera.mask.empty() || camera.mask.at<uint8_t>(static_cast<int>(std::lround(pixel.y())),
                                                          static_cast<int>(std::lround(pixel.x()))) != 0);
      if (valid) {
        map.at<cv::Vec2f>(y, x) = cv::Vec2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      } else {
        valid_mask_.at<uint8_t>(y, x) = 0;
      }
    }
  }
  cv::convertMaps(map, cv::noArray(), integer_map_, fraction_map_, CV_16SC2);
}

cv::Mat RectifiedView::rectify(const cv::Mat& image) const {
  if (image.size() != sensor_size_px_ || image.type() != CV_8UC1) {
    throw std::invalid_argument(
        "RectifiedView: image: expected 8UC1 of " + std::to_string(sensor_size_px_.width) + "x" +
        std::to_string(sensor_size_px_.height) + ", got " + std::to_string(image.cols) + "x" +
        std::to_string(image.rows) + " " + cv::typeToString(image.type()));
  }
  cv::Mat view;
  cv::remap(image, view, integer_map_, fraction_map_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  return view;
}

bool RectifiedView::toSensor(const Eigen::Vector2d& view_px, Eigen::Vector2d* sensor_px) const {
  Eigen::Vector3d ray_in_view;
  if (!isInside(view_px, valid_mask_.size()) || !model_.unproject(view_px, &ray_in_view) ||
      valid_mask_.at<uint8_t>(static_cast<int>(std::lround(view_px.y())),
                              static_cast<int>(std::lround(view_px.x()))) == 0) {
    return false;
  }
  const Eigen::Vector3d ray_in_camera = view_from_camera_.conjugate() * ray_in_view;
  Eigen::Vector2d pixel;
  if (ray_in_camera.z() < min_cos_angle_ || !camera_.project(ray_in_camera, &pixel) ||
      !isInside(pixel, sensor_size_px_)) {
    return false;
  }
  *sensor_px = pixel;
  return true;
}

ImageFeatures RectifiedView::toSensor(const ImageFeatures& in_view) const {
  ImageFeatures in_sensor;
  in_sensor.descriptors = cv::Mat(0, in_view.descriptors.cols, in_view.descriptors.type());
  for (size_t i = 0; i < in_view.size(); ++i) {
    Keypoint keypoint = in_view.keypoints[i];
    Eigen::Vector2d pixel;
    if (toSensor(Eigen::Vector2d(keypoint.position_px.x, keypoint.position_px.y), &pixel)) {
      keypoint.position_px = cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      in_sensor.keypoints.push_back(keypoint);
      in_sensor.descriptors.push_back(in_view.descriptors.row(static_cast<int>(i)));
    }
  }
  return in_sensor;
}

std::optional<Eigen::Quaterniond> commonViewOrientation(const Eigen::Quaterniond& frame_from_first,
                                                        const Eigen::Quaterniond& frame_from_second,
                                                        const Eigen::Vector3d& up_in_frame,
                                                        double max_angle_rad) {
  const Eigen::Vector3d first_axis = frame_from_first * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d second_axis = frame_from_second * Eigen::Vector3d::UnitZ();
  const double angle = std::atan2(first_axis.cross(second_axis).norm(), first_axis.dot(second_axis));
  if (!(angle <= max_angle_rad)) {
    return std::nullopt;
  }
  const Eigen::Vector3d z = (first_axis + second_axis).normalized();
  const Eigen::Vector3d x = z.cross(up_in_frame);
  constexpr double kMinLevel = 1e-3;
  if (!(x.norm() > kMinLevel * up_in_frame.norm())) {
    return std::nullopt;
  }
  Eigen::Matrix3d frame_from_view;
  frame_from_view.col(0) = x.normalized();
  frame_from_view.col(1) = z.cross(x.normalized());
  frame_from_view.col(2) = z;
  return Eigen::Quaterniond(frame_from_view);
}

RectifiedViewCache::RectifiedViewCache(std::shared_ptr<const CameraRig> rig,
                                       const RectifiedViewCacheOptions& options)
    : rig_(std::move(rig)), options_(options) {
  options.validate();
  check(rig_ != nullptr && rig_->hasExtrinsics(),
        "RectifiedViewCache: the rig must have vehicle_from_camera");
}

std::optional<RectifiedPair> RectifiedViewCache::pair(size_t first, size_t second, double yaw_rad) {
  check(first < rig_->cameras.size() && second < rig_->cameras.size(),
        "RectifiedViewCache: no camera of this index");
  check(std::isfinite(yaw_rad), "RectifiedViewCache: the yaw must be finite");
  const int yaw_steps = static_cast<int>(std::lround(std::remainder(yaw_rad, 2.0 * kPi) / kYawStep_rad));
  const auto cached = std::find_if(pairs_.begin(), pairs_.end(), [&](const Entry& entry) {
    return entry.first == first && entry.second == second && entry.yaw_steps == yaw_steps;
  });
  if (cached != pairs_.end()) {
    pairs_.splice(pairs_.begin(), pairs_, cached);
    return pairs_.front().pair;
  }
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw_steps * kYawStep_rad, Eigen::Vector3d::UnitZ()));
  const RigCamera& first_camera = rig_->cameras[first];
  const RigCamera& second_camera = rig_->cameras[second];
  const Eigen::Quaterniond frame_from_first = first_camera.vehicle_from_camera->rotation();
  const Eigen::Quaterniond frame_from_second = turn * second_camera.vehicle_from_camera->rotation();
  const auto frame_from_view =
      commonViewOrientation(frame_from_first, frame_from_second, Eigen::Vector3d::UnitZ(), kMaxAxisAngle_rad);
  if (!frame_from_view) {
    return std::nullopt;
  }
  const Eigen::Quaterniond view_from_frame = frame_from_view->conjugate();
  RectifiedPair made{
      std::make_shared<const RectifiedView>(first_camera, view_from_frame * frame_from_first, options_.view),
      std::make_shared<const RectifiedView>(second_camera, view_from_frame * frame_from_second,
                                            options_.view)};
  pairs_.push_front({first, second, yaw_steps, made});
  if (pairs_.size() > static_cast<size_t>(options_.max_pairs)) {
    pairs_.pop_back();
  }
  return made;
}

}  // namespace vcharge
