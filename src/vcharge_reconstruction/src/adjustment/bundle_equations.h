#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/CholmodSupport>
#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "adjustment/bundle_errors.h"
#include "vcharge_reconstruction/bundle_solver.h"

namespace vcharge {

/// The damped normal equations of a bundle adjustment: points are eliminated (Schur complement), the reduced
/// system of the poses and the tail, which is the odometer's factors and the cameras where they are unknown,
/// is factorized by CHOLMOD.
///
/// A pose's derivative follows from that of the point: J_pose = J_point [-I, cross(point - position)]. So a
/// point's observations from one pose, by whatever camera, enter as one 3x3 sum, a slot. Where the cameras
/// are unknown a slot is of one camera, whose derivative follows alike: J_camera = J_point R_vehicle [-I,
/// cross(point - camera)], the latter in the vehicle's frame.
class BundleEquations {
 public:
  /// Both must outlive this.
  BundleEquations(const BundleProblem& problem, const BundleErrors& errors);

  /// Takes all derivatives at a state.
  void linearize(const BundleState& state);

  /// The state after the step of the equations, with `damping` times their diagonal added to it. Gives the
  /// decrease of the cost that the linear model expects; 0 where the equations have no solution.
  double step(double damping, BundleState* next);

  /// See bundleCovariance().
  BundleCovariance covariance();

 private:
  using Matrix63d = Eigen::Matrix<double, 6, 3>;
  using Matrix36d = Eigen::Matrix<double, 3, 6>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;

  struct Slot {
    int32_t pose = 0;
    int32_t point = 0;
    int32_t camera = 0;                                        ///< of the first observation
    Eigen::Vector3d from_vehicle_m = Eigen::Vector3d::Zero();  ///< of the point, along the map's axes
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();     ///< sum of J_point^T J_point
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();        ///< sum of J_point^T error
    Matrix63d with_point = Matrix63d::Zero();                  ///< J_pose^T J_point
    Matrix63d over_point = Matrix63d::Zero();  ///< that times the inverse of the point's damped information
    Matrix36d by_camera = Matrix36d::Zero();   ///< J_camera = J_point by_camera
    Matrix63d camera_with_point = Matrix63d::Zero();  ///< J_camera^T J_point
  };
  struct PointTerms {
    Eigen::Vector3d gradient, damping;
    Eigen::Matrix3d inverse;  ///< of its damped information
  };
  /// What odometer and rig contribute beside the observations: blocks of a pose with itself, with the one
  /// before and with the tail, and the gradient.
  struct MotionTerms {
    std::vector<Matrix6d> own, with_previous;
    Eigen::MatrixXd with_tail;
    Eigen::MatrixXd tail;
    Eigen::VectorXd gradient;
  };
  /// What the observations contribute to the tail, given the points; and the gradient before and after.
  struct TailTerms {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient, reduced_gradient, diagonal;
  };
  struct Scratch {
    std::vector<int32_t> block_of_pose;
    std::vector<Matrix6d> blocks;
  };

  // Unknowns of the reduced system: all poses but the first, then the tail.
  static Eigen::Index columnOf(size_t pose) { return static_cast<Eigen::Index>(6 * (pose - 1)); }
  Eigen::Index tailColumn() const { return columnOf(rows_of_pose_.size()); }
  Eigen::Index tailSize() const {
    return 2 + 6 * static_cast<Eigen::Index>(problem_.vehicle_from_camera.size());
  }
  static Eigen::Index cameraInTail(int32_t camera) { return 2 + 6 * static_cast<Eigen::Index>(camera); }
  bool hasCameras() const { return !problem_.vehicle_from_camera.empty(); }

  /// Whether the slot's camera is unknown.
  bool hasCamera(const Slot& slot) const { return hasCameras() && slot.camera != kGroundCamera; }

  void makeSlots();
  void makePattern();
  void linearizePoint(size_t point);
  void eliminatePoint(size_t point, double damping);
  MotionTerms motionTerms() const;
  TailTerms tailTerms() const;
  void assemble(double damping);
  void assemblePose(size_t pose, double damping, MotionTerms* motions, Scratch* scratch);
  void assembleTail(double damping, const MotionTerms& motions);
  /// Of a point: what its move does to the tail, rows of the tail by the point's axes, given the tail's
  /// columns of the inverse.
  Eigen::MatrixXd pointInfluence(size_t point, const Eigen::MatrixXd& inverse) const;

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
