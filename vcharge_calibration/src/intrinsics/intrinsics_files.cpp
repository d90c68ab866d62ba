#include "vcharge_calibration/intrinsics/intrinsics_files.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

namespace {

/// Name of a model in other formats, and the positions of its parameters there, in the order of
/// parameterNames().
struct CamodocalParameter {
  const char* section;
  const char* key;
};
struct ForeignModel {
  const char* name;
  const char* kalibr_model;
  const char* kalibr_distortion;
  size_t num_kalibr_intrinsics;  // the first parameters; the others are distortion_coeffs
  const char* camodocal_model;
  std::vector<CamodocalParameter> camodocal;
};

const std::vector<ForeignModel>& foreignModels() {
  static const char* const kMirror = "mirror_parameters";
  static const char* const kDistortion = "distortion_parameters";
  static const char* const kProjection = "projection_parameters";
  static const std::vector<ForeignModel> kModels = {{MeiCamera::kName,
                                                     "omni",
                                                     "radtan",
                                                     5,
                                                     "MEI",
                                                     {{kMirror, "xi"},
                                                      {kProjection, "gamma1"},
                                                      {kProjection, "gamma2"},
                                                      {kProjection, "u0"},
                                                      {kProjection, "v0"},
                                                      {kDistortion, "k1"},
                                                      {kDistortion, "k2"},
                                                      {kDistortion, "p1"},
                                                      {kDistortion, "p2"}}},
                                                    {KannalaBrandtCamera::kName,
                                                     "pinhole",
                                                     "equidistant",
                                                     4,
                                                     "KANNALA_BRANDT",
                                                     {{kProjection, "mu"},
                                                      {kProjection, "mv"},
                                                      {kProjection, "u0"},
                                                      {kProjection, "v0"},
                                                      {kProjection, "k2"},
                                                      {kProjection, "k3"},
                                                      {kProjection, "k4"},
                                                      {kProjection, "k5"}}},
                                                    {PinholeCamera::kName,
                                                     "pinhole",
                                                     "radtan",
                                                     4,
                                                     "PINHOLE",
                                                     {{kProjection, "fx"},
                                                      {kProjection, "fy"},
                                                      {kProjection, "cx"},
                                                      {kProjection, "cy"},
                                                      {kDistortion, "k1"},
                                                      {kDistortion, "k2"},
                                                      {kDistortion, "p1"},
                                                      {kDistortion, "p2"}}}};
  return kModels;
}

const ForeignModel& foreignModel(const std::string& name) {
  for (const ForeignModel& model : foreignModels()) {
    if (name == model.name) {
      return model;
    }
  }
  throw std::logic_error("intrinsics_files: a camera model without a foreign name");
}

// Formats a number exactly to the last bit.
std::string exact(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  const std::string result = text.data();
  return result.find_first_of(".en") == std::string::npos ? result + ".0" : result;
}

std::string listOf(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) {
    text += (text.empty() ? "" : ", ") + exact(value);
  }
  return "[" + text + "]";
}

/// A map in Kalibr's or CamOdoCal's file; `key` is its path in errors.
class Section {
 public:
  Section(const YAML::Node& node, std::string source, std::string key)
      : node_(node), source_(std::move(source)), key_(std::move(key)) {}

  [[noreturn]] void fail(const std::string& name, const std::string& expected) const {
    throw InputError(source_ + ": " + key_ + name + ": expected " + expected);
  }
  std::string text(const std::string& name) const {
    const YAML::Node child = node_[name];
    if (!child.IsDefined() || !child.IsScalar()) {
      fail(name, "a word");
    }
    return child.as<std::string>();
  }
  double number(const std::string& name) const {
    const YAML::Node child = node_[name];
    double value = 0.0;
    if (!child.IsDefined() || !YAML::convert<double>::decode(child, value) || !std::isfinite(value)) {
      fail(name, "a finite number");
    }
    return value;
  }
  std::vector<double> numbers(const std::string& name, size_t count) const {
    const YAML::Node child = node_[name];
    std::vector<double> values;
    if (child.IsDefined() && child.IsSequence()) {
      for (const YAML::Node& entry : child) {
        double value = 0.0;
        if (YAML::convert<double>::decode(entry, value) && std::isfinite(value)) {
          values.push_back(value);
        }
      }
    }
    if (values.size() != count || child.size() != count) {
      fail(name, std::to_string(count) + " finite numbers");
    }
    return values;
  }
  int positive(const std::string& name) const {
    const double value = number(name);
    if (!(value >= 1.0 && value <= 1e5) || value != std::floor(value)) {
      fail(name, "a positive whole number");
    }
    return static_cast<int>(value);
  }
  Section child(const std::string& name) const {
    const YAML::Node child = node_[name];
    if (!child.IsDefined() || !child.IsMap()) {
      fail(name, "a map");
    }
    return {child, source_, key_ + name + "."};
  }
  CameraModel model(const std::string& name, const std::vector<double>& values) const {
    try {
      return CameraModel::create(
          name, Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
    } catch (const std::invalid_argument& error) {
      throw InputError(source_ + ": " + key_ + ": " + error.what());
    }
  }

 private:
  YAML::Node node_;
  std::string source_, key_;
};

RigCamera cameraOf(const std::string& name, cv::Size size, const CameraModel& model,
                   double field_of_view_rad) {
  return {name, "camera_" + name + "_optical", size, model, field_of_view_rad, "", {}, {}, {}};
}

RigCamera readKalibrCamera(const std::string& name, const Section& section, double field_of_view_rad) {
  const std::string camera_model = section.text("camera_model");
  const std::string distortion = section.text("distortion_model");
  for (const ForeignModel& model : foreignModels()) {
    if (camera_model == model.kalibr_model && distortion == model.kalibr_distortion) {
      std::vector<double> values = section.numbers("intrinsics", model.num_kalibr_intrinsics);
      const std::vector<double> coefficients = section.numbers("distortion_coeffs", 4);
      values.insert(values.end(), coefficients.begin(), coefficients.end());
      const std::vector<double> size = section.numbers("resolution", 2);
      if (!(size[0] >= 1.0 && size[1] >= 1.0 && size[0] <= 1e5 && size[1] <= 1e5)) {
        section.fail("resolution", "a positive width and height");
      }
      return cameraOf(name, {static_cast<int>(size[0]), static_cast<int>(size[1])},
                      section.model(model.name, values), field_of_view_rad);
    }
  }
  section.fail("camera_model, distortion_model",
               "omni-radtan, pinhole-equidistant or pinhole-radtan, got " + camera_model + "-" + distortion);
}

CameraRig readKalibr(const YAML::Node& root, const std::string& path, double field_of_view_rad) {
  CameraRig rig;
  for (size_t i = 0; root["cam" + std::to_string(i)].IsDefined(); ++i) {
    const std::string name = "cam" + std::to_string(i);
    rig.cameras.push_back(readKalibrCamera(name, Section(root, path, "").child(name), field_of_view_rad));
  }
  return rig;
}

CameraRig readCamodocal(const YAML::Node& root, const std::string& path, double field_of_view_rad) {
  const Section section(root, path, "");
  const std::string type = section.text("model_type");
  for (const ForeignModel& model : foreignModels()) {
    if (type == model.camodocal_model) {
      std::vector<double> values;
      for (const auto& [part, key] : model.camodocal) {
        values.push_back(section.child(part).number(key));
      }
      const cv::Size size(section.positive("image_width"), section.positive("image_height"));
      const std::string name = section.text("camera_name");
      if (!isCameraName(name)) {
        section.fail("camera_name", "a letter, then letters, digits and underscores, got '" + name + "'");
      }
      CameraRig rig;
      rig.cameras.push_back(cameraOf(name, size, section.model(model.name, values), field_of_view_rad));
      return rig;
    }
  }
  section.fail("model_type", "MEI, KANNALA_BRANDT or PINHOLE, got '" + type + "'");
}

std::string kalibrText(const CameraRig& rig) {
  std::ostringstream text;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const RigCamera& camera = rig.cameras[i];
    const ForeignModel& model = foreignModel(camera.model.name());
    const Eigen::VectorXd parameters = camera.model.parameters();
    const std::vector<double> values(parameters.data(), parameters.data() + parameters.size());
    const auto split = values.begin() + static_cast<std::ptrdiff_t>(model.num_kalibr_intrinsics);
    text << "cam" << i << ":\n";
    if (i > 0 && rig.hasExtrinsics()) {
      const RigidTransform camera_from_previous =
          camera.vehicle_from_camera->inverse() * *rig.cameras[i - 1].vehicle_from_camera;
      const Eigen::Matrix<double, 3, 4> matrix = camera_from_previous.matrix();
      text << "  T_cn_cnm1:\n";
      for (int row = 0; row < 3; ++row) {
        text << "  - " << listOf({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)}) << "\n";
      }
      text << "  - [0.0, 0.0, 0.0, 1.0]\n";
    }
    text << "  cam_overlaps: []\n  camera_model: " << model.kalibr_model
         << "\n  distortion_coeffs: " << listOf({split, values.end()})
         << "\n  distortion_model: " << model.kalibr_distortion
         << "\n  intrinsics: " << listOf({values.begin(), split}) << "\n  resolution: ["
         << camera.image_size_px.width << ", " << camera.image_size_px.height << "]\n  rostopic: /camera/"
         << camera.name << "/image_raw\n";
  }
  return text.str();
}

std::string camodocalText(const RigCamera& camera) {
  const ForeignModel& model = foreignModel(camera.model.name());
  const Eigen::VectorXd parameters = camera.model.parameters();
  std::ostringstream text;
  text << "%YAML:1.0\n---\nmodel_type: " << model.camodocal_model << "\ncamera_name: " << camera.name
       << "\nimage_width: " << camera.image_size_px.width << "\nimage_height: " << camera.image_size_px.height
       << "\n";
  for (const char* section : {"mirror_parameters", "distortion_parameters", "projection_parameters"}) {
    std::string lines;
    for (size_t i = 0; i < model.camodocal.size(); ++i) {
      if (model.camodocal[i].section == std::string(section)) {
        lines += std::string("   ") + model.camodocal[i].key + ": " +
                 exact(parameters[static_cast<Eigen::Index>(i)]) + "\n";
      }
    }
    if (!lines.empty()) {
      text << section << ":\n" << lines;
    }
  }
  return text.str();
}

}  // namespace

IntrinsicsFormat intrinsicsFormat(const std::string& name) {
  if (name == "rig") {
    return IntrinsicsFormat::kRig;
  }
  if (name == "kalibr") {
    return IntrinsicsFormat::kKalibr;
  }
  if (name == "camodocal") {
    return IntrinsicsFormat::kCamodocal;
  }
  throw std::invalid_argument("expected the format rig, kalibr or camodocal, got '" + name + "'");
}

CameraRig readIntrinsics(const std::string& path, double field_of_view_rad) {
  std::string text = readTextFile(path);
  // OpenCV's first line is not a valid directive of YAML 1.2.
  if (text.rfind("%YAML:", 0) == 0) {
    text.erase(0, text.find('\n') == std::string::npos ? text.size() : text.find('\n') + 1);
  }
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(path + ": expected YAML: " + error.what());
  }
  if (root.IsMap() && root["model_type"].IsDefined()) {
    return readCamodocal(root, path, field_of_view_rad);
  }
  if (root.IsMap() && root["cam0"].IsDefined()) {
    return readKalibr(root, path, field_of_view_rad);
  }
  if (root.IsMap() && root["cameras"].IsDefined()) {
    return readCameraRig(path);
  }
  throw InputError(path +
                   ": expected cameras (rig.yaml), cam0 (Kalibr's camchain) or model_type (CamOdoCal)");
}

void writeIntrinsics(const CameraRig& rig, IntrinsicsFormat format, const std::string& path) {
  check(!rig.cameras.empty(), "writeIntrinsics: expected cameras");
  if (format == IntrinsicsFormat::kRig) {
    writeCameraRig(rig, path);
  } else if (format == IntrinsicsFormat::kKalibr) {
    writeTextFileAtomically(path, kalibrText(rig));
  } else if (rig.cameras.size() == 1) {
    writeTextFileAtomically(path, camodocalText(rig.cameras.front()));
  } else {
    throw InputError(path + ": CamOdoCal's format holds one camera, expected its name (--camera) out of " +
                     std::to_string(rig.cameras.size()));
  }
}

}  // namespace vcharge
