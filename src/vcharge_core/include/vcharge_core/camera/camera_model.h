#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vcharge_core/camera/kannala_brandt_camera.h"
#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/camera/pinhole_camera.h"

namespace vcharge {

/// A calibrated central camera of one of the supported models. Camera frame: z forward, x right, y down;
/// pixel centres have integer coordinates. A value type. Visit the concrete model once per array of points,
/// not per pixel:
///   camera.visit([&](const auto& model) { for (...) model.project(point, &pixel); });
/// Every model has kNumParameters, kFocalLengths, kName, parameterNames(), parameters(), project() and
/// unproject().
class CameraModel {
 public:
  using Variant = std::variant<MeiCamera, KannalaBrandtCamera, PinholeCamera>;

  CameraModel(const MeiCamera& model) : model_(model) {}            // NOLINT: implicit by design
  CameraModel(const KannalaBrandtCamera& model) : model_(model) {}  // NOLINT
  CameraModel(const PinholeCamera& model) : model_(model) {}        // NOLINT
  /// Creates a model by its name ("mei", "kannala_brandt", "pinhole") and its parameters in the order of
  /// parameterNames(). Throws std::invalid_argument for an unknown name, a wrong number of parameters, or
  /// values outside the model's domain.
  static CameraModel create(const std::string& name, const Eigen::VectorXd& parameters);
  /// Names of a model's parameters, in order. Throws std::invalid_argument for an unknown model.
  static std::vector<std::string> parameterNames(const std::string& model_name);

  template <class Function>
  decltype(auto) visit(Function&& function) const {
    return std::visit(std::forward<Function>(function), model_);
  }
  const Variant& variant() const { return model_; }

  std::string name() const;
  std::vector<std::string> parameterNames() const { return parameterNames(name()); }
  Eigen::VectorXd parameters() const;
  /// Pixel of the optical axis.
  Eigen::Vector2d principalPoint() const;
  /// A camera of the same model whose image is that of this one, magnified `magnification` times about the
  /// principal point and then shifted.
  CameraModel withImage(double magnification, const Eigen::Vector2d& shift_px) const;

  /// Projects points in the camera frame (3 x N, any positive scale) to pixels; valid[i] is 0 where the model
  /// has no image of the point.
  void project(const Eigen::Matrix3Xd& points_in_camera, Eigen::Matrix2Xd* pixels,
               std::vector<uint8_t>* valid) const;
  /// Unit rays of pixels (2 x N); valid[i] is 0 where the model has no ray for the pixel.
  void unproject(const Eigen::Matrix2Xd& pixels, Eigen::Matrix3Xd* rays_in_camera,
                 std::vector<uint8_t>* valid) const;

  /// For single points, where speed does not matter.
  bool project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel) const {
    return visit([&](const auto& model) { return model.project(point_in_camera, pixel); });
  }
  bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const {
    return visit([&](const auto& model) { return model.unproject(pixel, ray_in_camera); });
  }

 private:
  Variant model_;
};

}  // namespace vcharge
