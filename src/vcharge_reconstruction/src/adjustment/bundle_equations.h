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

/// Damped normal equations of a bundle adjustment. Points are eliminated (Schur complement); CHOLMOD
/// factorizes the reduced system of the free poses and the tail: the odometer's factors, and the extrinsics
/// where they are unknown.
///
/// The derivative by a pose follows from that by the point: J_pose = J_point [-I, cross(point - position)].
/// All terms of a point at one pose therefore enter as one 3x3 sum, a slot. Where the extrinsics are unknown,
/// a slot has the observations of one camera, with J_camera = J_point R_vehicle [-I, cross(point - camera)],
/// the latter in the vehicle's frame. A ground observation has a slot of its own.
///
/// With unknown intrinsics, a slot has one observation. Its derivative by the camera's image deviation is
/// written as J_point X as well: J_point has full rank, and X = J_point^T (J_point J_point^T)^-1 J_deviation.
/// Likewise where a camera's lines are exposed one after the other: the vehicle has then moved on, and X of a
/// change of the exposure's time is the opposite of the point's velocity in the vehicle's frame.
class BundleEquations {
 public:
  /// Both must outlive this object.
  BundleEquations(const BundleProblem& problem, const BundleErrors& errors);

  /// Computes all derivatives at a state.
  void linearize(const BundleState& state);

  /// Computes the state after one step; `damping` times the diagonal is added to the equations. Returns the
  /// decrease of the cost in the linear model; 0 where the equations have no solution.
  double step(double damping, BundleState* next);

  /// See bundleCovariance().
  BundleCovariance covariance();

 private:
  using Matrix63d = Eigen::Matrix<double, 6, 3>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  // One row or column per unknown of a camera: 6, then 3 with unknown intrinsics, then 2 with unknown timing.
  using Matrix3Cd = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 11>;
  using MatrixC3d = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, 11, 3>;

  struct Slot {
    int32_t pose = 0;
    int32_t point = 0;
    int32_t camera = 0;         ///< camera of the first image observation
    bool is_ground = false;     ///< a ground observation instead of image observations
    size_t begin = 0, end = 0;  ///< its observations, or its ground observation
    Eigen::Vector3d from_vehicle_m = Eigen::Vector3d::Zero();  ///< point - position, along the map's axes
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();     ///< sum of J_point^T J_point
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();        ///< sum of J_point^T error
    Matrix63d with_point = Matrix63d::Zero();                  ///< J_pose^T J_point
    Matrix63d over_point = Matrix63d::Zero();  ///< with_point times the inverse of the point's information
  };
  /// The terms of a slot with unknown extrinsics.
  struct CameraSlot {
    Matrix3Cd by_camera;          ///< J_camera = J_point by_camera
    MatrixC3d camera_with_point;  ///< J_camera^T J_point
  };
  /// The terms of a point's slots in one camera with unknown extrinsics.
  struct CameraTerms {
    int32_t camera = 0;
    MatrixC3d with_point;  ///< sum of camera_with_point
  };
  struct PointTerms {
    Eigen::Vector3d gradient, damping;
    Eigen::Matrix3d inverse;  ///< inverse of the damped information
  };
  /// Contribution of the terms without points (odometer factors, priors): blocks of each pose with itself,
  /// with the previous pose and with the tail, and the gradient.
  struct PriorTerms {
    std::vector<Matrix6d> own, with_previous;
    Eigen::MatrixXd with_tail;
    Eigen::MatrixXd tail;
    Eigen::VectorXd gradient;
  };
  /// Contribution of the observations to the tail after elimination of the points, and the gradient before
  /// and after elimination.
  struct TailTerms {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient, reduced_gradient, diagonal;
  };
  struct Scratch {
    std::vector<int32_t> block_of_pose;
    std::vector<Matrix6d> blocks;
  };

  // Unknowns of the reduced system: the free poses, then the tail.
  size_t firstFreePose() const { return problem_.numFixedPoses(); }
  bool isFree(size_t pose) const { return pose >= firstFreePose(); }
  Eigen::Index columnOf(size_t pose) const { return 6 * static_cast<Eigen::Index>(pose - firstFreePose()); }
  Eigen::Index tailColumn() const { return columnOf(problem_.map_from_vehicle.size()); }
  Eigen::Index tailSize() const {
    return 2 + cameraSize() * static_cast<Eigen::Index>(problem_.vehicle_from_camera.size());
  }
  Eigen::Index cameraInTail(int32_t camera) const { return 2 + cameraSize() * Eigen::Index{camera}; }
  bool hasCameras() const { return !problem_.vehicle_from_camera.empty(); }
  bool hasDeviations() const { return !problem_.image_deviations.empty(); }
  bool hasTimings() const { return !problem_.timing_deviations.empty(); }
  Eigen::Index timingInCamera() const { return hasDeviations() ? 9 : 6; }
  Eigen::Index cameraSize() const { return timingInCamera() + (hasTimings() ? 2 : 0); }
  /// Whether the derivative by a camera differs from observation to observation of a point at a pose.
  bool hasOwnDerivatives(const BundleObservation& observation) const;
  /// Whether the slot's errors depend on unknown extrinsics.
  bool hasCamera(const Slot& slot) const { return hasCameras() && !slot.is_ground; }

  void makeSlots();
  void makeCameraTerms();
  void makePattern();
  void linearizePoint(size_t point);
  /// `by_camera`: its columns by the image's deviation are set; null where there are none.
  void addImageErrors(const Eigen::Vector3d& point, Slot* slot, Matrix3Cd* by_camera) const;
  /// Derivative of the point by the extrinsics and the timing of the slot's camera.
  void setCameraMoves(const Slot& slot, Matrix3Cd* by_camera) const;
  void addGroundError(Slot* slot) const;
  void eliminatePoint(size_t point, double damping);
  PriorTerms priorTerms() const;
  void addCameraPriors(PriorTerms* terms) const;
  TailTerms tailTerms() const;
  void assemble(double damping);
  void assemblePose(size_t pose, double damping, PriorTerms* priors, Scratch* scratch);
  void assembleTail(double damping, const PriorTerms& priors);
  /// Derivative of the tail by the gradient of a point, one row per unknown of the tail, given the tail's
  /// columns of the inverse.
  Eigen::MatrixXd pointInfluence(size_t point, const Eigen::MatrixXd& inverse) const;

  const BundleProblem& problem_;
  const BundleErrors& errors_;
  BundleState state_;
  std::vector<Slot> slots_;               ///< ordered by point, then by pose
  std::vector<CameraSlot> camera_slots_;  ///< of slots_; empty without unknown extrinsics
  std::vector<size_t> first_slot_of_point_;
  std::vector<std::vector<size_t>> slots_of_pose_;
  std::vector<std::vector<int32_t>> rows_of_pose_;  ///< earlier poses with a common term, and itself
  std::vector<PointTerms> points_;
  std::vector<CameraTerms> cameras_;  ///< ordered by point, then by camera; empty without unknown extrinsics
  std::vector<size_t> first_camera_of_point_;
  Eigen::SparseMatrix<double> reduced_;                    ///< upper triangle
  Eigen::VectorXd gradient_, reduced_gradient_, damping_;  ///< one per unknown of the reduced system
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Upper> factorization_;
};

}  // namespace vcharge
