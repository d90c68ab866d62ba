#include "vcharge_recordings/vcharge_recording.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr int64_t kNanosecondsPerMicrosecond = 1000;
constexpr double kMaxSkew_px = 1e-6;
// Outlines of the car's body and of the housing in the left mirror camera's image, drawn by hand on the mean
// of the images with a margin of a few pixels.
const cv::Size kOutlineImageSize(1280, 800);
const std::vector<std::vector<cv::Point>> kVehicleOutlines = {
    // Outline of fender and door handle at the bottom, and of the housing's rim on the left.
    {{0, 0},
     {158, 0},
     {132, 40},
     {108, 84},
     {74, 155},
     {52, 225},
     {42, 300},
     {34, 380},
     {30, 470},
     {36, 488},
     {80, 545},
     {134, 602},
     {140, 632},
     {186, 678},
     {244, 720},
     {330, 764},
     {430, 800},
     {0, 800}},
    // Outline of door, window and pillar.
    {{805, 800},
     {860, 764},
     {905, 734},
     {1000, 673},
     {1098, 624},
     {1160, 585},
     {1190, 566},
     {1250, 554},
     {1280, 562},
     {1280, 800}},
    // Outline of the housing's rim at the upper right.
    {{1170, 0}, {1205, 28}, {1236, 74}, {1256, 150}, {1270, 230}, {1280, 290}, {1280, 0}},
};

std::vector<std::string> readLines(const std::string& path) {
  std::istringstream text(readTextFile(path));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    lines.push_back(line);
  }
  return lines;
}

Timestamp fromMicroseconds(const std::string& text, const std::string& source) {
  if (text.empty() || text.size() > 16 || !std::all_of(text.begin(), text.end(), ::isdigit)) {
    throw InputError(source + ": expected a stamp in microseconds, got '" + text + "'");
  }
  return Timestamp::fromNanoseconds(std::stoll(text) * kNanosecondsPerMicrosecond);
}

struct Calibration {
  CameraModel model;
  RigidTransform system_from_camera;
};

Calibration readCalibration(const std::string& path) {
  std::istringstream text(readTextFile(path));
  double skew, fx, fy, cx, cy, xi, k1, k2, p1, p2;
  Eigen::Matrix<double, 3, 4> matrix;
  text >> fx >> skew >> cx >> fy >> cy >> xi >> k1 >> k2 >> p1 >> p2;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      text >> matrix(row, column);
    }
  }
  if (!text) {
    throw InputError(path + ": expected fx skew cx fy cy xi k1 k2 p1 p2 and a 3x4 matrix");
  }
  if (std::abs(skew) > kMaxSkew_px) {
    throw InputError(path + ": skew: expected 0, got " + std::to_string(skew));
  }
  MeiCamera::Parameters parameters;
  parameters << xi, fx, fy, cx, cy, k1, k2, p1, p2;
  try {
    return {MeiCamera(parameters), RigidTransform::fromMatrix(matrix)};
  } catch (const std::exception& error) {
    throw InputError(path + ": " + error.what());
  }
}

std::vector<VehicleOdometry> readPoses(const std::string& path, const RigidTransform& system_from_base) {
  const std::vector<std::string> lines = readLines(path);
  std::vector<VehicleOdometry> poses;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].empty() || lines[i][0] == '#') {
      continue;
    }
    const std::string source = path + ":" + std::to_string(i + 1);
    std::istringstream text(lines[i]);
    std::string stamp;
    double yaw, pitch, roll;
    Eigen::Vector3d translation;
    text >> stamp >> yaw >> pitch >> roll >> translation.x() >> translation.y() >> translation.z();
    if (!text) {
      throw InputError(source + ": expected time_us yaw pitch roll tx ty tz");
    }
    VehicleOdometry pose;
    pose.stamp = fromMicroseconds(stamp, source);
    if (!poses.empty() && pose.stamp <= poses.back().stamp) {
      throw InputError(source + ": expected stamps that increase, got " + toString(pose.stamp) + " after " +
                       toString(poses.back().stamp));
    }
    const RigidTransform world_from_system(rotationFromYawPitchRoll(yaw, pitch, roll), translation);
    pose.odom_from_vehicle = world_from_system * system_from_base;
    poses.push_back(pose);
  }
  return poses;
}

std::vector<VchargeRecording::ImageFile> readImageList(const std::string& folder) {
  const std::string path = folder + "/images.txt";
  const std::vector<std::string> lines = readLines(path);
  std::vector<VchargeRecording::ImageFile> images;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].empty()) {
      continue;
    }
    const std::string source = path + ":" + std::to_string(i + 1);
    const std::string stem = std::filesystem::path(lines[i]).stem().string();
    const size_t underscore = stem.rfind('_');
    VchargeRecording::ImageFile image;
    image.stamp =
        fromMicroseconds(underscore == std::string::npos ? "" : stem.substr(underscore + 1), source);
    image.path = folder + "/" + lines[i];
    if (!images.empty() && image.stamp <= images.back().stamp) {
      throw InputError(source + ": expected stamps that increase, got " + lines[i]);
    }
    images.push_back(image);
  }
  if (images.empty()) {
    throw InputError(path + ": expected names of images, got none");
  }
  return images;
}

// Pose of base_link: on the ground below the system's origin, z normal to the ground, x in the x-z plane.
RigidTransform systemFromBase(const VchargeRecordingOptions& options) {
  const Eigen::Vector3d normal =
      Eigen::Vector3d(-options.ground_slope_x, -options.ground_slope_y, 1.0).normalized();
  const Eigen::Vector3d left = normal.cross(Eigen::Vector3d::UnitX()).normalized();
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << left.cross(normal), left, normal, Eigen::Vector3d(0.0, 0.0, options.ground_height_m);
  return RigidTransform::fromMatrix(matrix);
}

cv::Mat drawVehicleMask(cv::Size size) {
  cv::Mat mask(kOutlineImageSize, CV_8UC1, cv::Scalar(255));
  cv::fillPoly(mask, kVehicleOutlines, cv::Scalar(0));
  cv::Mat scaled;
  cv::resize(mask, scaled, size, 0.0, 0.0, cv::INTER_NEAREST);
  return scaled;
}

}  // namespace

void VchargeRecordingOptions::validate() const {
  if (!isCameraName(camera_name)) {
    throw std::invalid_argument("camera_name: must be letters, digits and underscores, is '" + camera_name +
                                "'");
  }
  requireField(field_of_view_rad > 0.0 && field_of_view_rad <= 2.0 * M_PI, "field_of_view_rad",
               "must be in (0, 2 pi]", field_of_view_rad);
  requireField(std::isfinite(ground_height_m), "ground_height_m", "must be finite", ground_height_m);
  requireField(std::abs(ground_slope_x) < 1.0, "ground_slope_x", "must be in (-1, 1)", ground_slope_x);
  requireField(std::abs(ground_slope_y) < 1.0, "ground_slope_y", "must be in (-1, 1)", ground_slope_y);
  requireField(odometry_margin_s >= 0.0, "odometry_margin_s", "must not be negative", odometry_margin_s);
}

VchargeRecording readVchargeRecording(const std::string& folder, const VchargeRecordingOptions& options) {
  options.validate();
  VchargeRecording recording;
  recording.images = readImageList(folder);
  const Calibration calibration = readCalibration(folder + "/calib.txt");
  const RigidTransform system_from_base = systemFromBase(options);

  const std::string poses_path = folder + "/system_poses.txt";
  std::vector<VehicleOdometry> poses = readPoses(poses_path, system_from_base);
  const Timestamp first = recording.images.front().stamp;
  const Timestamp last = recording.images.back().stamp;
  if (poses.size() < 2 || poses.front().stamp > first || poses.back().stamp < last) {
    throw InputError(poses_path + ": expected poses from the first image at " + toString(first) +
                     " to the last at " + toString(last));
  }
  fillVelocities(&poses);
  const Duration margin = durationFromSeconds(options.odometry_margin_s);
  for (const VehicleOdometry& pose : poses) {
    if (pose.stamp >= first - margin && pose.stamp <= last + margin) {
      recording.odometry.push_back(pose);
    }
  }

  const cv::Mat image = cv::imread(recording.images.front().path, cv::IMREAD_GRAYSCALE);
  if (image.empty()) {
    throw InputError(recording.images.front().path + ": expected an image, cannot be read");
  }
  RigCamera camera{options.camera_name, "camera_" + options.camera_name + "_optical", image.size(),
                   calibration.model};
  camera.field_of_view_rad = options.field_of_view_rad;
  if (options.mask_vehicle) {
    camera.mask_file = options.camera_name + "_mask.png";
    camera.mask = drawVehicleMask(image.size());
  }
  camera.vehicle_from_camera = system_from_base.inverse() * calibration.system_from_camera;
  recording.rig.cameras.push_back(camera);
  return recording;
}

}  // namespace vcharge
