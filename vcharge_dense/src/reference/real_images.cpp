#include "reference/real_images.h"

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

RigidTransform readCalibration(const std::string& path, CameraModel* camera) {
  std::istringstream text(readTextFile(path));
  double fx, skew, cx, fy, cy, xi, k1, k2, p1, p2;
  text >> fx >> skew >> cx >> fy >> cy >> xi >> k1 >> k2 >> p1 >> p2;
  Eigen::Matrix<double, 3, 4> matrix;
  for (int i = 0; i < 12; ++i) {
    text >> matrix(i / 4, i % 4);
  }
  if (!text) {
    throw InputError(path + ": expected 10 intrinsics and 12 numbers of vehicle_from_camera");
  }
  *camera = MeiCamera((MeiCamera::Parameters() << xi, fx, fy, cx, cy, k1, k2, p1, p2).finished());
  return RigidTransform::fromMatrix(matrix);
}

std::map<int64_t, RigidTransform> readPoses(const std::string& path) {
  std::istringstream text(readTextFile(path));
  std::map<int64_t, RigidTransform> world_from_vehicle;
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line[0] == '#') {
      continue;
    }
    std::istringstream fields(line);
    int64_t time_us;
    double yaw, pitch, roll, x, y, z;
    if (!(fields >> time_us >> yaw >> pitch >> roll >> x >> y >> z)) {
      throw InputError(path + ": expected 'time_us yaw pitch roll x y z', got '" + line + "'");
    }
    world_from_vehicle[time_us] =
        RigidTransform(rotationFromYawPitchRoll(yaw, pitch, roll), Eigen::Vector3d(x, y, z));
  }
  return world_from_vehicle;
}

}  // namespace

Plane RealImages::groundInCamera() const {
  const Eigen::Vector3d normal = vehicle_from_camera.rotation().conjugate() * ground_in_vehicle.normal;
  return {normal,
          ground_in_vehicle.distance_m + ground_in_vehicle.normal.dot(vehicle_from_camera.translation())};
}

std::optional<RealImages> readRealImages() {
  const char* data = std::getenv("VCHARGE_DATA");
  if (data == nullptr || *data == '\0') {
    return std::nullopt;
  }
  const std::string folder = std::string(data) + "/vcharge_left";
  RealImages images{MeiCamera(1, 1, 1, 0, 0), RigidTransform(), {}, {}, {}, {}, folder};
  images.vehicle_from_camera = readCalibration(folder + "/calib.txt", &images.camera);
  // z = -0.832 + 0.0036 x - 0.0045 y, from SOURCE.txt.
  const Eigen::Vector3d normal(-0.0036, 0.0045, 1.0);
  images.ground_in_vehicle = {normal.normalized(), 0.832 / normal.norm()};
  const auto world_from_vehicle = readPoses(folder + "/system_poses.txt");
  std::istringstream names(readTextFile(folder + "/images.txt"));
  for (std::string name; names >> name;) {
    const int64_t time_us = std::stoll(name.substr(name.rfind('_') + 1));
    const auto pose = world_from_vehicle.find(time_us);
    const cv::Mat pixels = cv::imread(folder + "/" + name, cv::IMREAD_GRAYSCALE);
    if (pixels.empty() || pose == world_from_vehicle.end()) {
      throw InputError(folder + "/" + name + ": expected a readable image whose stamp has a pose");
    }
    images.stamps.push_back(Timestamp::fromNanoseconds(1000 * time_us));
    images.pixels.push_back(pixels);
    images.world_from_camera.push_back(pose->second * images.vehicle_from_camera);
  }
  return images;
}

}  // namespace vcharge
