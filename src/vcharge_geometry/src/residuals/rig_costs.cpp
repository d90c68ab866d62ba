#include "vcharge_geometry/residuals/rig_costs.h"

#include <stdexcept>
#include <utility>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>
#include <Eigen/Eigenvalues>

#include "residuals/pose_jacobians.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
template <int kRows, int kColumns>
using RowMajor = Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>;

/// Parts of a pose block.
struct Pose {
  explicit Pose(const double* block)
      : translation(block),
        quaternion(block + 3),
        rotation(Eigen::Quaterniond(quaternion).toRotationMatrix()) {}
  Eigen::Map<const Eigen::Vector3d> translation;
  Eigen::Map<const Eigen::Quaterniond> quaternion;
  Eigen::Matrix3d rotation;
};

/// Converts a derivative by [dt, dphi] to one by the pose block.
template <int kRows>
void writeByPose(const Eigen::Matrix<double, kRows, 3>& by_translation,
                 const Eigen::Matrix<double, kRows, 3>& by_turn, const double* block, double* jacobian) {
  // Eigen requires column vectors to be column-major; these matrices have several columns.
  Eigen::Map<RowMajor<kRows, 7>> matrix(jacobian);
  matrix.template leftCols<3>() = by_translation;
  matrix.template rightCols<4>() = by_turn * turnByQuaternion(block + 3);
}

/// Common part of both reprojection costs. Jacobians may be null.
template <class Model>
void reproject(const Model& model, const Eigen::Vector2d& pixel, double weight,
               const double* map_from_vehicle, const double* vehicle_from_camera, const double* point,
               double* residuals, double* by_vehicle, double* by_camera, double* by_intrinsics,
               double* by_point) {
  const Pose vehicle(map_from_vehicle);
  const Pose camera(vehicle_from_camera);
  const Eigen::Vector3d from_vehicle_in_map = Eigen::Map<const Eigen::Vector3d>(point) - vehicle.translation;
  const Eigen::Vector3d from_camera_in_vehicle =
      vehicle.rotation.transpose() * from_vehicle_in_map - camera.translation;
  const Eigen::Vector3d point_in_camera = camera.rotation.transpose() * from_camera_in_vehicle;
  Eigen::Vector2d projected;
  Eigen::Matrix<double, 2, 3> pixel_by_point;
  Eigen::Matrix<double, 2, Model::kNumParameters> pixel_by_parameters;
  const bool seen = model.project(point_in_camera, &projected, &pixel_by_point,
                                  by_intrinsics != nullptr ? &pixel_by_parameters : nullptr);
  if (!seen) {
    projected.setConstant(kNoImageResidual / weight);
    projected += pixel;
    pixel_by_point.setZero();
    pixel_by_parameters.setZero();
  }
  Eigen::Map<Eigen::Vector2d>(residuals, 2) = weight * (projected - pixel);
  const Eigen::Matrix<double, 2, 3> by_camera_frame = weight * pixel_by_point * camera.rotation.transpose();
  const Eigen::Matrix<double, 2, 3> by_map_frame = by_camera_frame * vehicle.rotation.transpose();
  if (by_vehicle != nullptr) {
    writeByPose<2>(-by_map_frame, by_map_frame * crossMatrix(from_vehicle_in_map), map_from_vehicle,
                   by_vehicle);
  }
  if (by_camera != nullptr) {
    writeByPose<2>(-by_camera_frame, by_camera_frame * crossMatrix(from_camera_in_vehicle),
                   vehicle_from_camera, by_camera);
  }
  if (by_intrinsics != nullptr) {
    Eigen::Map<RowMajor<2, Model::kNumParameters>> matrix(by_intrinsics);
    matrix = weight * pixel_by_parameters;
  }
  if (by_point != nullptr) {
    Eigen::Map<RowMajor<2, 3>> matrix(by_point);
    matrix = by_map_frame;
  }
}

double* blockOf(double** jacobians, int block) {
  return jacobians == nullptr ? nullptr : jacobians[block];
}

template <class Model>
class ReprojectionCost : public ceres::SizedCostFunction<2, 7, 7, Model::kNumParameters, 3> {
 public:
  ReprojectionCost(const Eigen::Vector2d& pixel, double sigma_px) : pixel_(pixel), weight_(1.0 / sigma_px) {}

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    try {
      const typename Model::Parameters parameters = Eigen::Map<const typename Model::Parameters>(blocks[2]);
      const Model model(parameters);
      reproject(model, pixel_, weight_, blocks[0], blocks[1], blocks[3], residuals, blockOf(jacobians, 0),
                blockOf(jacobians, 1), blockOf(jacobians, 2), blockOf(jacobians, 3));
    } catch (const std::invalid_argument&) {
      return false;
    }
    return true;
  }

 private:
  const Eigen::Vector2d pixel_;
  const double weight_;
};

class KnownCameraReprojectionCost : public ceres::SizedCostFunction<2, 7, 7, 3> {
 public:
  KnownCameraReprojectionCost(std::shared_ptr<const CameraModel> model, const Eigen::Vector2d& pixel,
                              double sigma_px)
      : model_(std::move(model)), pixel_(pixel), weight_(1.0 / sigma_px) {}

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    model_->visit([&](const auto& model) {
      reproject(model, pixel_, weight_, blocks[0], blocks[1], blocks[2], residuals, blockOf(jacobians, 0),
                blockOf(jacobians, 1), nullptr, blockOf(jacobians, 2));
    });
    return true;
  }

 private:
  const std::shared_ptr<const CameraModel> model_;
  const Eigen::Vector2d pixel_;
  const double weight_;
};

/// Matrix A with A^T A = information. Throws std::logic_error unless it is symmetric positive semidefinite.
Matrix6d squareRootOf(const Matrix6d& information) {
  check(information.allFinite() && information.isApprox(information.transpose(), 1e-9),
        "information: expected a finite, symmetric matrix");
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  check(eigen.eigenvalues().minCoeff() >= -1e-9 * eigen.eigenvalues().maxCoeff(),
        "information: expected a positive semidefinite matrix");
  return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
}

class OdometryCost : public ceres::SizedCostFunction<6, 7, 7, 2> {
 public:
  OdometryCost(const RigidTransform& previous_from_current, const Matrix6d& information)
      : measured_m_(previous_from_current.translation().head<2>()),
        measured_yaw_rad_(yawOfRotation(previous_from_current.rotation())),
        square_root_(squareRootOf(information)) {}

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const Pose previous(blocks[0]);
    const Pose current(blocks[1]);
    const double distance_scale = blocks[2][0];
    const double turn_scale = blocks[2][1];
    // The measured motion, corrected by the odometer scales: the chord rotates by half of the correction of
    // the turn.
    const Eigen::Rotation2Dd bend(0.5 * (turn_scale - 1.0) * measured_yaw_rad_);
    const Eigen::Vector2d chord = bend * measured_m_;
    const Eigen::Vector2d chord_by_bend(-chord.y(), chord.x());
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(turn_scale * measured_yaw_rad_, Eigen::Vector3d::UnitZ()));

    const Eigen::Vector3d between_in_map = current.translation - previous.translation;
    const Eigen::Vector3d moved = previous.rotation.transpose() * between_in_map;
    const Eigen::Vector3d turn_error =
        vectorFromRotation(turn.conjugate() * Eigen::Quaterniond(previous.quaternion).conjugate() *
                           Eigen::Quaterniond(current.quaternion));
    Eigen::Matrix<double, 6, 1> error;
    error << moved.head<2>() - distance_scale * chord, moved.z(), turn_error;
    Eigen::Map<Eigen::Matrix<double, 6, 1>>(residuals, 6) = square_root_ * error;
    if (jacobians == nullptr) {
      return true;
    }
    // Rotating either pose in the map multiplies the error from the right; Log(E Exp(d)) = e + Jl(-e)^-1 d.
    const Eigen::Matrix3d error_by_turn = leftJacobianInverse(-turn_error) * current.rotation.transpose();
    Eigen::Matrix<double, 6, 3> by_translation = Eigen::Matrix<double, 6, 3>::Zero();
    Eigen::Matrix<double, 6, 3> by_turn = Eigen::Matrix<double, 6, 3>::Zero();
    by_translation.topRows<3>() = previous.rotation.transpose();
    by_turn.bottomRows<3>() = error_by_turn;
    if (jacobians[1] != nullptr) {
      writeByPose<6>(square_root_ * by_translation, square_root_ * by_turn, blocks[1], jacobians[1]);
    }
    if (jacobians[0] != nullptr) {
      by_turn.topRows<3>() = -previous.rotation.transpose() * crossMatrix(between_in_map);
      writeByPose<6>(-square_root_ * by_translation, -square_root_ * by_turn, blocks[0], jacobians[0]);
    }
    if (jacobians[2] != nullptr) {
      Eigen::Matrix<double, 6, 2> by_odometer = Eigen::Matrix<double, 6, 2>::Zero();
      by_odometer.block<2, 1>(0, 0) = -chord;
      by_odometer.block<2, 1>(0, 1) = -0.5 * distance_scale * measured_yaw_rad_ * chord_by_bend;
      by_odometer.block<3, 1>(3, 1) = -measured_yaw_rad_ * leftJacobianInverse(turn_error).col(2);
      Eigen::Map<RowMajor<6, 2>> matrix(jacobians[2]);
      matrix = square_root_ * by_odometer;
    }
    return true;
  }

 private:
  const Eigen::Vector2d measured_m_;
  const double measured_yaw_rad_;
  const Matrix6d square_root_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> makeReprojectionCost(const CameraModel& model,
                                                          const Eigen::Vector2d& pixel, double sigma_px) {
  check(sigma_px > 0.0, "makeReprojectionCost: sigma_px must be positive");
  return model.visit([&](const auto& concrete) -> std::unique_ptr<ceres::CostFunction> {
    return std::make_unique<ReprojectionCost<std::decay_t<decltype(concrete)>>>(pixel, sigma_px);
  });
}

std::unique_ptr<ceres::CostFunction> makeReprojectionCost(std::shared_ptr<const CameraModel> model,
                                                          const Eigen::Vector2d& pixel, double sigma_px) {
  check(sigma_px > 0.0, "makeReprojectionCost: sigma_px must be positive");
  return std::make_unique<KnownCameraReprojectionCost>(std::move(model), pixel, sigma_px);
}

std::unique_ptr<ceres::CostFunction> makeOdometryCost(const RigidTransform& previous_from_current,
                                                      const Eigen::Matrix<double, 6, 6>& information) {
  return std::make_unique<OdometryCost>(previous_from_current, information);
}

}  // namespace vcharge
