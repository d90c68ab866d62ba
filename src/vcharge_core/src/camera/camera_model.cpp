#include "vcharge_core/camera/camera_model.h"

#include <stdexcept>

namespace vcharge {
namespace {

/// Calls `function` with a null pointer whose type is the model called `name`.
template <class Function>
auto visitModelType(const std::string& name, Function&& function) {
  if (name == MeiCamera::kName) {
    return function(static_cast<MeiCamera*>(nullptr));
  }
  if (name == KannalaBrandtCamera::kName) {
    return function(static_cast<KannalaBrandtCamera*>(nullptr));
  }
  if (name == PinholeCamera::kName) {
    return function(static_cast<PinholeCamera*>(nullptr));
  }
  throw std::invalid_argument("unknown camera model '" + name + "', expected mei, kannala_brandt or pinhole");
}

}  // namespace

CameraModel CameraModel::create(const std::string& name, const Eigen::VectorXd& parameters) {
  return visitModelType(name, [&](auto* type) -> CameraModel {
    using Model = std::remove_pointer_t<decltype(type)>;
    if (parameters.size() != Model::kNumParameters) {
      throw std::invalid_argument("camera model " + name + ": expected " +
                                  std::to_string(Model::kNumParameters) + " parameters, got " +
                                  std::to_string(parameters.size()));
    }
    return Model(typename Model::Parameters(parameters));
  });
}

std::vector<std::string> CameraModel::parameterNames(const std::string& model_name) {
  return visitModelType(model_name, [](auto* type) {
    const auto names = std::remove_pointer_t<decltype(type)>::parameterNames();
    return std::vector<std::string>(names.begin(), names.end());
  });
}

std::string CameraModel::name() const {
  return visit([](const auto& model) { return std::string(model.kName); });
}

Eigen::VectorXd CameraModel::parameters() const {
  return visit([](const auto& model) { return Eigen::VectorXd(model.parameters()); });
}

Eigen::Vector2d CameraModel::principalPoint() const {
  Eigen::Vector2d pixel;
  project(Eigen::Vector3d(Eigen::Vector3d::UnitZ()), &pixel);
  return pixel;
}

CameraModel CameraModel::withImage(double magnification, const Eigen::Vector2d& shift_px) const {
  return visit([&](const auto& model) -> CameraModel {
    using Model = std::decay_t<decltype(model)>;
    typename Model::Parameters values = model.parameters();
    values.template segment<2>(Model::kFocalLengths) *= magnification;
    values.template segment<2>(Model::kFocalLengths + 2) += shift_px;
    return Model(values);
  });
}

void CameraModel::project(const Eigen::Matrix3Xd& points_in_camera, Eigen::Matrix2Xd* pixels,
                          std::vector<uint8_t>* valid) const {
  pixels->setZero(2, points_in_camera.cols());
  valid->assign(points_in_camera.cols(), 0);
  visit([&](const auto& model) {
    Eigen::Vector2d pixel;
    for (Eigen::Index i = 0; i < points_in_camera.cols(); ++i) {
      if (model.project(points_in_camera.col(i), &pixel)) {
        pixels->col(i) = pixel;
        (*valid)[i] = 1;
      }
    }
  });
}

void CameraModel::unproject(const Eigen::Matrix2Xd& pixels, Eigen::Matrix3Xd* rays_in_camera,
                            std::vector<uint8_t>* valid) const {
  rays_in_camera->setZero(3, pixels.cols());
  valid->assign(pixels.cols(), 0);
  visit([&](const auto& model) {
    Eigen::Vector3d ray;
    for (Eigen::Index i = 0; i < pixels.cols(); ++i) {
      if (model.unproject(pixels.col(i), &ray)) {
        rays_in_camera->col(i) = ray;
        (*valid)[i] = 1;
      }
    }
  });
}

}  // namespace vcharge
