#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/CholmodSupport>
#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "bundle_errors.h"

namespace vcharge {

/// The damped normal equations of a bundle adjustment: points are eliminated (Schur complement), the reduced
/// system of the poses and the odometer's factors is factorized by CHOLMOD.
///
/// A pose's derivative follows from that of the point: J_pose = J_point [-I, cross(point - position)]. So a
/// point's observations from one pose, by whatever camera, enter as one 3x3 sum, a slot.
class BundleEquations {
 public:
  /// Both must outlive this.
  BundleEquations(const BundleProblem& problem, const BundleErrors& errors);

  /// Takes all derivatives at a state.
  void linearize(const BundleState& state);

  /// The state after the step of the equations, with `damping` times their diagonal added to it. Gives the
  /// decrease of the cost that the linear model expects; 0 where the equations have no solution.
  double step(double damping, BundleState* next);

 private:
  using Matrix63d = Eigen::Matrix<double, 6, 3>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;

  struct Slot {
    int32_t pose = 0;
    int32_t point = 0;
    Eigen::Vector3d from_vehicle_m = Eigen::Vector3d::Zero();  ///< of the point, along the map's axes
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();     ///< sum of J_point^T J_point
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();        ///< sum of J_point^T error
    Matrix63d with_point = Matrix63d::Zero();                  ///< J_pose^T J_point
    Matrix63d over_point = Matrix63d::Zero();  ///< that times the inverse of the point's damped information
  };
  struct PointTerms {
    Eigen::Vector3d gradient, damping;
    Eigen::Matrix3d inverse;  ///< of its damped information
  };
  /// What the odometer contributes: blocks of a pose with itself and with the one before, and its gradient.
  struct MotionTerms {
    std::vector<Matrix6d> own, with_previous;
    Eigen::MatrixXd with_odometer;
    Eigen::Matrix2d odometer;
    Eigen::VectorXd gradient;
  };
  struct Scratch {
    std::vector<int32_t> block_of_pose;
    std::vector<Matrix6d> blocks;
  };

  // Unknowns of the reduced system: all poses but the first, then the odometer's factors.
  static Eigen::Index columnOf(size_t pose) { return static_cast<Eigen::Index>(6 * (pose - 1)); }
  Eigen::Index odometerColumn() const { return columnOf(rows_of_pose_.size()); }

  void makeSlots();
  void makePattern();
  void linearizePoint(size_t point);
  void eliminatePoint(size_t point, double damping);
  MotionTerms motionTerms() const;
  void assemble(double damping);
  void assemblePose(size_t pose, double damping, const MotionTerms& motions, Scratch* scratch);
  void assembleOdometer(double damping, const MotionTerms& motions);

  const BundleProblem& problem_;
  const BundleErrors& errors_;
  BundleState state_;
  std::vector<Slot> slots_;  ///< by point, by pose within a point
  std::vector<size_t> first_slot_of_point_;
  std::vector<std::vector<size_t>> slots_of_pose_;
  std::vector<std::vector<int32_t>> rows_of_pose_;  ///< earlier poses that see a common point, and itself
  std::vector<PointTerms> points_;
  Eigen::SparseMatrix<double> reduced_;                    ///< upper triangle
  Eigen::VectorXd gradient_, reduced_gradient_, damping_;  ///< of the reduced system's unknowns
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Upper> factorization_;
};

}  // namespace vcharge
