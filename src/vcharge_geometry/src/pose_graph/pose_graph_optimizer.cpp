#include "vcharge_geometry/pose_graph/pose_graph_optimizer.h"

#include <array>
#include <cmath>
#include <map>

#include <ceres/ceres.h>
#include <Eigen/Eigenvalues>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Matrix A with A^T A = information, which may be singular.
Matrix6d squareRoot(const Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
}

/// Cost over [x, y, yaw] of both nodes.
class PlanarCost {
 public:
  PlanarCost(const RigidTransform& measured, const Matrix6d& square_root)
      : measured_(measured), measured_yaw_(yawOfRotation(measured.rotation())), square_root_(square_root) {}

  template <class T>
  bool operator()(const T* first, const T* second, T* residuals) const {
    using std::atan2;
    using std::cos;
    using std::sin;
    const T dx = second[0] - first[0];
    const T dy = second[1] - first[1];
    // The difference in the first frame, then in the measured frame of the second.
    const T x = cos(first[2]) * dx + sin(first[2]) * dy - measured_.translation().x();
    const T y = -sin(first[2]) * dx + cos(first[2]) * dy - measured_.translation().y();
    const T turn = second[2] - first[2] - measured_yaw_;
    const double cosine = std::cos(measured_yaw_);
    const double sine = std::sin(measured_yaw_);
    Eigen::Matrix<T, 6, 1> error;
    error << cosine * x + sine * y, -sine * x + cosine * y, T(0.0), T(0.0), T(0.0),
        atan2(sin(turn), cos(turn));
    Eigen::Map<Eigen::Matrix<T, 6, 1>> mapped(residuals);
    mapped = square_root_.cast<T>() * error;
    return true;
  }

 private:
  RigidTransform measured_;
  double measured_yaw_;
  Matrix6d square_root_;
};

/// Cost over [x, y, z] and the quaternion [x, y, z, w] of both nodes.
class SpatialCost {
 public:
  SpatialCost(const RigidTransform& measured, const Matrix6d& square_root)
      : second_from_first_(measured.inverse()), square_root_(square_root) {}

  template <class T>
  bool operator()(const T* first_translation, const T* first_rotation, const T* second_translation,
                  const T* second_rotation, T* residuals) const {
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t1(first_translation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t2(second_translation);
    const Eigen::Map<const Eigen::Quaternion<T>> q1(first_rotation);
    const Eigen::Map<const Eigen::Quaternion<T>> q2(second_rotation);
    const Eigen::Quaternion<T> measured = second_from_first_.rotation().template cast<T>();
    const Eigen::Quaternion<T> turn = measured * q1.conjugate() * q2;
    Eigen::Matrix<T, 6, 1> error;
    error.template head<3>() =
        measured * (q1.conjugate() * (t2 - t1)) + second_from_first_.translation().template cast<T>();
    error.template tail<3>() = turn.w() < T(0.0) ? Eigen::Matrix<T, 3, 1>(-turn.vec()) : turn.vec();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> mapped(residuals);
    mapped = square_root_.cast<T>() * error;
    return true;
  }

 private:
  RigidTransform second_from_first_;
  Matrix6d square_root_;
};

/// Parameters of a node: [x, y, yaw], or [x, y, z] and [qx, qy, qz, qw].
using NodeParameters = std::array<double, 7>;

NodeParameters parametersOf(const RigidTransform& pose, bool planar) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  return planar ? NodeParameters{t.x(), t.y(), yawOfRotation(q)}
                : NodeParameters{t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

RigidTransform poseOf(const NodeParameters& p, bool planar) {
  return planar
             ? RigidTransform::planar(p[0], p[1], p[2])
             : RigidTransform(Eigen::Quaterniond(p[6], p[3], p[4], p[5]), Eigen::Vector3d(p[0], p[1], p[2]));
}

}  // namespace

PoseGraphSummary optimizePoseGraph(const std::vector<double>& weights, int max_iterations, PoseGraph* graph) {
  check(weights.empty() || weights.size() == graph->edges.size(),
        "optimizePoseGraph: expected one weight for each edge");
  PoseGraphSummary summary;
  if (graph->map_from_node.empty()) {
    summary.converged = true;
    return summary;
  }
  std::map<int64_t, NodeParameters> nodes;
  for (const auto& [node, pose] : graph->map_from_node) {
    nodes[node] = parametersOf(pose, graph->planar);
  }
  ceres::Problem problem;
  for (auto& [node, parameters] : nodes) {
    if (graph->planar) {
      problem.AddParameterBlock(parameters.data(), 3);
    } else {
      problem.AddParameterBlock(parameters.data(), 3);
      problem.AddParameterBlock(parameters.data() + 3, 4, new ceres::EigenQuaternionManifold);
    }
  }
  for (size_t i = 0; i < graph->edges.size(); ++i) {
    const double weight = weights.empty() ? 1.0 : weights[i];
    if (weight <= 0.0) {
      continue;
    }
    const PoseGraphEdge& edge = graph->edges[i];
    double* first = nodes.at(edge.first).data();
    double* second = nodes.at(edge.second).data();
    const Matrix6d square_root = std::sqrt(weight) * squareRoot(edge.information);
    if (graph->planar) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PlanarCost, 6, 3, 3>(
                                   new PlanarCost(edge.first_from_second, square_root)),
                               nullptr, first, second);
    } else {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SpatialCost, 6, 3, 4, 3, 4>(
                                   new SpatialCost(edge.first_from_second, square_root)),
                               nullptr, first, first + 3, second, second + 3);
    }
  }
  problem.SetParameterBlockConstant(nodes.begin()->second.data());
  if (!graph->planar) {
    problem.SetParameterBlockConstant(nodes.begin()->second.data() + 3);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.function_tolerance = 1e-8;
  options.initial_trust_region_radius = 1e8;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary solved;
  ceres::Solve(options, &problem, &solved);
  for (const auto& [node, parameters] : nodes) {
    graph->map_from_node[node] = poseOf(parameters, graph->planar);
  }
  summary.converged = solved.termination_type == ceres::CONVERGENCE;
  // Ceres' cost is half the sum of squares.
  summary.initial_chi_squared = 2.0 * solved.initial_cost;
  summary.final_chi_squared = 2.0 * solved.final_cost;
  summary.num_iterations = static_cast<int>(solved.iterations.size());
  return summary;
}

}  // namespace vcharge
