#include "vcharge_core/camera/camera_rig.h"

#include <algorithm>
#include <cctype>

#include "vcharge_core/base/error.h"

namespace vcharge {

bool isCameraName(const std::string& name) {
  const auto isNamePart = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  return !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) != 0 &&
         std::all_of(name.begin(), name.end(), isNamePart);
}

int CameraRig::findCamera(const std::string& name) const {
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].name == name) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

size_t CameraRig::cameraIndex(const std::string& name) const {
  const int index = findCamera(name);
  if (index < 0) {
    std::string names;
    for (const RigCamera& camera : cameras) {
      names += (names.empty() ? "" : ", ") + camera.name;
    }
    throw InputError("camera '" + name + "': not in the rig, whose cameras are " + names);
  }
  return static_cast<size_t>(index);
}

std::optional<Eigen::Matrix<double, 6, 6>> CameraRig::covarianceWithScale(size_t camera) const {
  std::optional<Eigen::Matrix<double, 6, 6>> covariance = cameras.at(camera).covariance;
  if (covariance) {
    const Eigen::Vector3d by_scale_m = scale_sigma * cameras[camera].vehicle_from_camera->translation();
    covariance->topLeftCorner<3, 3>() += by_scale_m * by_scale_m.transpose();
  }
  return covariance;
}

bool CameraRig::hasExtrinsics() const {
  for (const RigCamera& camera : cameras) {
    if (!camera.vehicle_from_camera) {
      return false;
    }
  }
  return !cameras.empty();
}

bool haveSameImages(const CameraRig& a, const CameraRig& b) {
  return std::equal(a.cameras.begin(), a.cameras.end(), b.cameras.begin(), b.cameras.end(),
                    [](const RigCamera& one, const RigCamera& other) {
                      return one.name == other.name && one.image_size_px == other.image_size_px;
                    });
}

void checkImageSize(const RigCamera& camera, cv::Size size, const std::string& source) {
  if (size != camera.image_size_px) {
    throw InputError(source + ": expected images of " + std::to_string(camera.image_size_px.width) + "x" +
                     std::to_string(camera.image_size_px.height) + " px as in the rig for camera '" +
                     camera.name + "', got " + std::to_string(size.width) + "x" +
                     std::to_string(size.height));
  }
}

}  // namespace vcharge
