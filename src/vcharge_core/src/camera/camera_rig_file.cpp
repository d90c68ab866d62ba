// Reading and writing of rig.yaml.
#include "vcharge_core/camera/camera_rig.h"

#include <algorithm>
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
// Longer ones are milliseconds or microseconds by mistake.
constexpr double kMaxReadout_s = 0.2, kMaxClockOffset_s = 1.0, kMaxStampTolerance_s = 0.1;

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

/// An optional standard deviation; 0 where it is not given.
double readSigma(const Entry& parent, const std::string& key) {
  if (!parent.node[key].IsDefined()) {
    return 0.0;
  }
  const Entry entry = parent.required(key);
  const double sigma = entry.number();
  if (!(sigma >= 0.0)) {
    entry.fail("at least 0");
  }
  return sigma;
}

ImageTiming readTiming(const Entry& camera) {
  ImageTiming timing;
  if (camera.node["readout_s"].IsDefined()) {
    const Entry readout = camera.required("readout_s");
    timing.readout_s = readout.number();
    if (!(timing.readout_s >= 0.0 && timing.readout_s <= kMaxReadout_s)) {
      readout.fail("seconds from 0 to " + exact(kMaxReadout_s));
    }
  }
  if (camera.node["readout_direction"].IsDefined()) {
    const Entry direction = camera.required("readout_direction");
    timing.readout_direction = static_cast<ReadoutDirection>(
        internal::readEnum(direction.node, direction.source, direction.key, enumNames<ReadoutDirection>()));
  }
  if (camera.node["clock_offset_s"].IsDefined()) {
    const Entry offset = camera.required("clock_offset_s");
    timing.clock_offset_s = offset.number();
    if (!(std::abs(timing.clock_offset_s) <= kMaxClockOffset_s)) {
      offset.fail("seconds from -" + exact(kMaxClockOffset_s) + " to " + exact(kMaxClockOffset_s));
    }
  }
  return timing;
}

RigCamera readCamera(const std::string& name, const Entry& entry, const std::string& mask_folder) {
  checkKeys(
      entry.node, entry.source, entry.key,
      {"frame_id", "image_size_px", "model", "intrinsics", "field_of_view_rad", "mask", "vehicle_from_camera",
       "focal_sigma", "principal_point_sigma_px", "readout_s", "readout_direction", "clock_offset_s"});
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
    camera.focal_sigma = readSigma(entry, "focal_sigma");
    camera.principal_point_sigma_px = readSigma(entry, "principal_point_sigma_px");
    camera.timing = readTiming(entry);
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
  checkKeys(root, source, "", {"vehicle_frame", "provenance", "scale_sigma", "stamp_tolerance_s", "cameras"});
  CameraRig rig;
  if (root["provenance"].IsDefined()) {
    rig.provenance = readProvenance(top.required("provenance"));
  }
  if (root["vehicle_frame"].IsDefined()) {
    rig.vehicle_frame = top.required("vehicle_frame").text();
  }
  rig.scale_sigma = readSigma(top, "scale_sigma");
  if (root["stamp_tolerance_s"].IsDefined()) {
    const Entry tolerance = top.required("stamp_tolerance_s");
    rig.stamp_tolerance_s = tolerance.number();
    if (!(rig.stamp_tolerance_s >= 0.0 && rig.stamp_tolerance_s <= kMaxStampTolerance_s)) {
      tolerance.fail("seconds from 0 to " + exact(kMaxStampTolerance_s) +
                     ", at most half a period of the cameras");
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
  if (rig.stamp_tolerance_s > 0.0) {
    text += "stamp_tolerance_s: " + exact(rig.stamp_tolerance_s) + "\n";
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
    if (camera.focal_sigma > 0.0) {
      text += "    focal_sigma: " + exact(camera.focal_sigma) + "\n";
    }
    if (camera.principal_point_sigma_px > 0.0) {
      text += "    principal_point_sigma_px: " + exact(camera.principal_point_sigma_px) + "\n";
    }
    if (camera.timing.readout_s > 0.0) {
      text += "    readout_s: " + exact(camera.timing.readout_s) + "\n    readout_direction: " +
              enumNames<ReadoutDirection>()[static_cast<size_t>(camera.timing.readout_direction)] + "\n";
    }
    if (camera.timing.clock_offset_s != 0.0) {
      text += "    clock_offset_s: " + exact(camera.timing.clock_offset_s) + "\n";
    }
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

}  // namespace vcharge
