#include "vcharge_core/camera/camera_rig.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

using internal::checkKeys;
using internal::throwBadField;

constexpr double kFullCircle = 6.283185307179587;

/// A node with its file and key, so that every error names both.
struct Entry {
  YAML::Node node;
  std::string source;
  std::string key;

  Entry required(const std::string& name) const {
    const Entry child{node[name], source, key.empty() ? name : key + "." + name};
    if (!child.node.IsDefined()) {
      throw InputError(source + ": " + child.key + ": missing");
    }
    return child;
  }
  [[noreturn]] void fail(const std::string& expected) const { throwBadField(source, key, expected, node); }
  double number() const {
    double value = 0.0;
    internal::readValue(node, source, key, &value);
    if (!std::isfinite(value)) {
      fail("a finite number");
    }
    return value;
  }
  std::string text() const {
    std::string value;
    internal::readValue(node, source, key, &value);
    return value;
  }
  std::vector<double> numbers(size_t count) const {
    std::vector<double> values;
    internal::readValue(node, source, key, &values);
    if (values.size() != count) {
      fail("a list of " + std::to_string(count) + " numbers");
    }
    for (const double value : values) {
      if (!std::isfinite(value)) {
        fail("finite numbers");
      }
    }
    return values;
  }
};

std::map<std::string, std::string> readProvenance(const Entry& entry) {
  std::map<std::string, std::string> provenance;
  if (!entry.node.IsMap()) {
    entry.fail("a map of texts");
  }
  for (const auto& item : entry.node) {
    if (!item.first.IsScalar()) {
      entry.fail("a map of texts");
    }
    const std::string key = item.first.Scalar();
    provenance[key] = entry.required(key).text();
  }
  return provenance;
}

RigidTransform readExtrinsics(const Entry& entry, std::optional<Eigen::Matrix<double, 6, 6>>* covariance) {
  checkKeys(entry.node, entry.source, entry.key, {"translation_m", "rotation_xyzw", "covariance"});
  const std::vector<double> t = entry.required("translation_m").numbers(3);
  const Entry rotation_entry = entry.required("rotation_xyzw");
  const std::vector<double> q = rotation_entry.numbers(4);
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1.0) > 1e-3) {
    rotation_entry.fail("a unit quaternion (its norm is " + std::to_string(rotation.norm()) + ")");
  }
  if (entry.node["covariance"].IsDefined()) {
    const Entry covariance_entry = entry.required("covariance");
    const std::vector<double> values = covariance_entry.numbers(36);
    const Eigen::Matrix<double, 6, 6> matrix =
        Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(values.data());
    if (!matrix.isApprox(matrix.transpose(), 1e-6) || (matrix.diagonal().array() < 0.0).any()) {
      covariance_entry.fail("a symmetric 6x6 matrix with a non-negative diagonal");
    }
    *covariance = matrix;
  }
  const Eigen::Vector3d translation_m(t[0], t[1], t[2]);
  // Normalizing a written unit quaternion again would change its last bits.
  return std::abs(rotation.norm() - 1.0) <= 1e-12 ? RigidTransform::fromUnit(rotation, translation_m)
                                                  : RigidTransform(rotation, translation_m);
}

cv::Mat readMask(const Entry& entry, const std::string& folder, cv::Size size) {
  const std::string path = (fs::path(folder) / entry.text()).string();
  // OpenCV would print its own warning about a missing file.
  cv::Mat mask = fs::is_regular_file(path) ? cv::imread(path, cv::IMREAD_GRAYSCALE) : cv::Mat();
  if (mask.empty()) {
    throw InputError(entry.source + ": " + entry.key + ": the image " + path + " cannot be read");
  }
  if (mask.size() != size) {
    throw InputError(entry.source + ": " + entry.key + ": expected a mask of " + std::to_string(size.width) +
                     "x" + std::to_string(size.height) + " px, " + path + " has " +
                     std::to_string(mask.cols) + "x" + std::to_string(mask.rows));
  }
  return mask;
}

RigCamera readCamera(const std::string& name, const Entry& entry, const std::string& mask_folder) {
  checkKeys(entry.node, entry.source, entry.key,
            {"frame_id", "image_size_px", "model", "intrinsics", "field_of_view_rad", "mask",
             "vehicle_from_camera"});
  const Entry size_entry = entry.required("image_size_px");
  const std::vector<double> size = size_entry.numbers(2);
  const auto isPixelCount = [](double value) {
    return value >= 1.0 && value <= 32767.0 && value == std::floor(value);
  };
  if (!isPixelCount(size[0]) || !isPixelCount(size[1])) {
    size_entry.fail("[width, height] as whole numbers from 1 to 32767");
  }

  const Entry model_entry = entry.required("model");
  const std::string model_name = model_entry.text();
  std::vector<std::string> parameter_names;
  try {
    parameter_names = CameraModel::parameterNames(model_name);
  } catch (const std::invalid_argument&) {
    model_entry.fail("mei, kannala_brandt or pinhole");
  }
  const Entry intrinsics = entry.required("intrinsics");
  checkKeys(intrinsics.node, intrinsics.source, intrinsics.key, parameter_names);
  Eigen::VectorXd parameters(parameter_names.size());
  for (size_t i = 0; i < parameter_names.size(); ++i) {
    parameters[static_cast<Eigen::Index>(i)] = intrinsics.required(parameter_names[i]).number();
  }
  try {
    RigCamera camera{name, "camera_" + name + "_optical",
                     cv::Size(static_cast<int>(size[0]), static_cast<int>(size[1])),
                     CameraModel::create(model_name, parameters)};
    if (entry.node["frame_id"].IsDefined()) {
      camera.frame_id = entry.required("frame_id").text();
    }
    if (entry.node["field_of_view_rad"].IsDefined()) {
      const Entry field_of_view = entry.required("field_of_view_rad");
      camera.field_of_view_rad = field_of_view.number();
      if (!(camera.field_of_view_rad > 0.0 && camera.field_of_view_rad <= kFullCircle)) {
        field_of_view.fail("an angle in (0, 2 pi]");
      }
    }
    if (entry.node["mask"].IsDefined()) {
      const Entry mask = entry.required("mask");
      camera.mask_file = mask.text();
      camera.mask = readMask(mask, mask_folder, camera.image_size_px);
    }
    if (entry.node["vehicle_from_camera"].IsDefined()) {
      camera.vehicle_from_camera = readExtrinsics(entry.required("vehicle_from_camera"), &camera.covariance);
    }
    return camera;
  } catch (const std::invalid_argument& error) {
    throw InputError(intrinsics.source + ": " + intrinsics.key + ": " + error.what());
  }
}

std::string exact(double value) {
  char text[40];
  for (int digits = 6; digits <= 17; ++digits) {
    std::snprintf(text, sizeof(text), "%.*g", digits, value);
    if (std::stod(text) == value) {
      break;
    }
  }
  return text;
}

template <class Container>
std::string exactList(const Container& values) {
  std::string text;
  for (const double value : values) {
    text += (text.empty() ? "[" : ", ") + exact(value);
  }
  return text + "]";
}

std::string maskFileOf(const RigCamera& camera) {
  return camera.mask_file.empty() ? camera.name + "_mask.png" : camera.mask_file;
}

}  // namespace

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

CameraRig readCameraRig(const std::string& path) {
  return parseCameraRig(readTextFile(path), path, fs::path(path).parent_path().string());
}

CameraRig parseCameraRig(const std::string& text, const std::string& source, const std::string& mask_folder) {
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(source + ": line " + std::to_string(error.mark.line + 1) +
                     ": not valid YAML: " + error.msg);
  }
  const Entry top{root, source, ""};
  if (!root.IsMap()) {
    throw InputError(source + ": expected a rig with the keys vehicle_frame and cameras");
  }
  checkKeys(root, source, "", {"vehicle_frame", "provenance", "scale_sigma", "cameras"});
  CameraRig rig;
  if (root["provenance"].IsDefined()) {
    rig.provenance = readProvenance(top.required("provenance"));
  }
  if (root["vehicle_frame"].IsDefined()) {
    rig.vehicle_frame = top.required("vehicle_frame").text();
  }
  if (root["scale_sigma"].IsDefined()) {
    const Entry scale_sigma = top.required("scale_sigma");
    rig.scale_sigma = scale_sigma.number();
    if (!(rig.scale_sigma >= 0.0)) {
      scale_sigma.fail("at least 0");
    }
  }
  const Entry cameras = top.required("cameras");
  if (!cameras.node.IsMap() || cameras.node.size() == 0) {
    cameras.fail("a map from camera names to cameras");
  }
  for (const auto& item : cameras.node) {
    if (!item.first.IsScalar()) {
      cameras.fail("a map from camera names to cameras");
    }
    const std::string name = item.first.Scalar();
    if (rig.findCamera(name) >= 0) {
      throw InputError(source + ": cameras." + name + ": the name is given twice");
    }
    if (!isCameraName(name)) {
      throw InputError(source + ": cameras." + name + ": expected a name of letters, digits and underscores");
    }
    const Entry camera{item.second, source, "cameras." + name};
    if (!camera.node.IsMap()) {
      camera.fail("a map");
    }
    rig.cameras.push_back(readCamera(name, camera, mask_folder));
  }
  return rig;
}

std::string formatCameraRig(const CameraRig& rig) {
  std::string text = "vehicle_frame: " + rig.vehicle_frame + "\n";
  if (!rig.provenance.empty()) {
    YAML::Emitter provenance;
    provenance << YAML::BeginMap << YAML::Key << "provenance" << YAML::Value << rig.provenance
               << YAML::EndMap;
    text += std::string(provenance.c_str()) + "\n";
  }
  if (rig.scale_sigma > 0.0) {
    text += "scale_sigma: " + exact(rig.scale_sigma) + "\n";
  }
  text += "cameras:\n";
  for (const RigCamera& camera : rig.cameras) {
    text += "  " + camera.name + ":\n";
    text += "    frame_id: " + camera.frame_id + "\n";
    text += "    image_size_px: [" + std::to_string(camera.image_size_px.width) + ", " +
            std::to_string(camera.image_size_px.height) + "]\n";
    text += "    model: " + camera.model.name() + "\n    intrinsics: {";
    const std::vector<std::string> names = camera.model.parameterNames();
    const Eigen::VectorXd parameters = camera.model.parameters();
    for (size_t i = 0; i < names.size(); ++i) {
      text += (i == 0 ? "" : ", ") + names[i] + ": " + exact(parameters[static_cast<Eigen::Index>(i)]);
    }
    text += "}\n    field_of_view_rad: " + exact(camera.field_of_view_rad) + "\n";
    if (!camera.mask.empty()) {
      text += "    mask: " + maskFileOf(camera) + "\n";
    }
    if (camera.vehicle_from_camera) {
      const RigidTransform& transform = *camera.vehicle_from_camera;
      const Eigen::Vector4d q = transform.rotation().coeffs();
      const Eigen::Vector3d t = transform.translation();
      text += "    vehicle_from_camera:\n      translation_m: " +
              exactList(std::vector<double>{t[0], t[1], t[2]}) +
              "\n      rotation_xyzw: " + exactList(std::vector<double>{q[0], q[1], q[2], q[3]}) + "\n";
      if (camera.covariance) {
        std::vector<double> values(36);
        Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(values.data()) = *camera.covariance;
        text += "      covariance: " + exactList(values) + "\n";
      }
    }
  }
  return text;
}

void writeCameraRig(const CameraRig& rig, const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  for (const RigCamera& camera : rig.cameras) {
    if (!camera.mask.empty()) {
      const std::string mask_path = (folder / maskFileOf(camera)).string();
      writeFileAtomically(mask_path, [&](const std::string& temporary) {
        if (!cv::imwrite(temporary, camera.mask)) {
          throw InputError(mask_path + ": cannot be written");
        }
      });
    }
  }
  writeTextFileAtomically(path, formatCameraRig(rig));
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
