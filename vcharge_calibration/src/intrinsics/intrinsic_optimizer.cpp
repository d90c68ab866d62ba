#include "intrinsics/intrinsic_optimizer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <ceres/ceres.h>

#include "boards/board_pose.h"
#include "vcharge_geometry/residuals/pose_block.h"
#include "vcharge_geometry/residuals/rig_costs.h"

namespace vcharge {

namespace {

constexpr int kMaxIterations = 200;
constexpr double kRobust_px = 1.0;
// Typical bending of a hand-held board, relative to its diagonal.
constexpr double kUsualBending = 0.003;
// Largest error of a view when a first camera is judged.
constexpr double kMaxInitialError_px = 20.0;
constexpr size_t kMaxInitialViews = 20;
constexpr size_t kFirstViews = 8;

Eigen::VectorXd parametersFor(const std::string& model_name, cv::Size size, double focal_px) {
  const double u0 = 0.5 * (size.width - 1);
  const double v0 = 0.5 * (size.height - 1);
  Eigen::VectorXd parameters =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(CameraModel::parameterNames(model_name).size()));
  if (model_name == MeiCamera::kName) {
    // Near the axis, a Mei camera has the focal length gamma / (1 + xi).
    parameters.head<5>() << 1.0, 2.0 * focal_px, 2.0 * focal_px, u0, v0;
  } else {
    parameters.head<4>() << focal_px, focal_px, u0, v0;
  }
  return parameters;
}

/// Reprojection error of a corner of a bent board. Blocks: pose, camera, intrinsics, bending (3).
class BentCornerCost : public ceres::CostFunction {
 public:
  /// `flat` has a point (3) in the position of the bending.
  BentCornerCost(std::unique_ptr<ceres::CostFunction> flat, const CalibrationBoard& board, int index)
      : flat_(std::move(flat)),
        corner_(board.corner(index)),
        basis_(PosedBoard::bendingBasis(board, corner_.head<2>())) {
    set_num_residuals(2);
    *mutable_parameter_block_sizes() = flat_->parameter_block_sizes();
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> bending(parameters[3]);
    const Eigen::Vector3d point = corner_ + Eigen::Vector3d(0.0, 0.0, bending.dot(basis_));
    const std::array<const double*, 4> flat_parameters = {parameters[0], parameters[1], parameters[2],
                                                          point.data()};
    if (jacobians == nullptr) {
      return flat_->Evaluate(flat_parameters.data(), residuals, nullptr);
    }
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_point;
    std::array<double*, 4> flat_jacobians = {jacobians[0], jacobians[1], jacobians[2], by_point.data()};
    if (!flat_->Evaluate(flat_parameters.data(), residuals, flat_jacobians.data())) {
      return false;
    }
    if (jacobians[3] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> by_bending(jacobians[3]);
      by_bending = by_point.col(2) * basis_.transpose();
    }
    return true;
  }

 private:
  std::unique_ptr<ceres::CostFunction> flat_;
  Eigen::Vector3d corner_, basis_;
};

/// Prior of a nearly flat board: bending divided by the typical bending. Blocks: bending (3).
class FlatnessCost : public ceres::SizedCostFunction<3, 3> {
 public:
  explicit FlatnessCost(double usual_m) : usual_m_(usual_m) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d>(residuals, 3) = Eigen::Map<const Eigen::Vector3d>(parameters[0]) / usual_m_;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix3d>(jacobians[0], 3, 3) = Eigen::Matrix3d::Identity() / usual_m_;
    }
    return true;
  }

 private:
  const double usual_m_;
};

/// Adjustment in the blocks of the bundle adjustment: the inverse poses of boards replace the vehicle's, with
/// the camera at its origin. All blocks lie in one array: Ceres orders blocks by their addresses, and the
/// last digits depend on that order.
class Adjustment {
 public:
  Adjustment(const CalibrationBoard& board, const std::vector<BoardView>& views, const FittedCamera& start,
             const FitSettings& settings)
      : manifold_(makePoseManifold()),
        problem_(ownership()),
        num_intrinsics_(start.model.parameters().size()),
        num_shapes_(settings.bending ? views.size() : static_cast<size_t>(board.numCorners())),
        num_views_(views.size()),
        bending_(settings.bending),
        blocks_(kPoseSize + static_cast<size_t>(num_intrinsics_) + 3 * num_shapes_ + kPoseSize * num_views_) {
    setPose(RigidTransform(), camera());
    Eigen::Map<Eigen::VectorXd>(intrinsicsBlock(), num_intrinsics_) = start.model.parameters();
    for (size_t s = 0; s < num_shapes_; ++s) {
      Eigen::Map<Eigen::Vector3d>(shape(s), 3) =
          bending_ ? start.boards[s].bending_m : board.corner(static_cast<int>(s));
    }
    for (size_t v = 0; v < num_views_; ++v) {
      setPose(start.boards[v].camera_from_board.inverse(), pose(v));
    }
    problem_.AddParameterBlock(camera(), kPoseSize);
    problem_.SetParameterBlockConstant(camera());
    problem_.AddParameterBlock(intrinsicsBlock(), static_cast<int>(num_intrinsics_));
    for (size_t s = 0; s < num_shapes_; ++s) {
      problem_.AddParameterBlock(shape(s), 3);
      if (!bending_) {
        problem_.SetParameterBlockConstant(shape(s));
      }
    }
    const double usual_bending_m = kUsualBending * board.corner(board.numCorners() - 1).norm();
    for (size_t v = 0; v < views.size(); ++v) {
      const double sigma_px = settings.sigmas_px.empty() ? settings.sigma_px : settings.sigmas_px[v];
      losses_.push_back(settings.loss == Loss::kRobust
                            ? std::make_unique<ceres::HuberLoss>(kRobust_px / sigma_px)
                            : nullptr);
      problem_.AddParameterBlock(pose(v), kPoseSize, manifold_.get());
      if (bending_) {
        problem_.AddResidualBlock(new FlatnessCost(usual_bending_m), nullptr, shape(v));
      }
      for (const BoardCorner& corner : views[v].corners) {
        auto cost = makeReprojectionCost(start.model, corner.pixel, sigma_px);
        if (bending_) {
          cost = std::make_unique<BentCornerCost>(std::move(cost), board, corner.index);
        }
        problem_.AddResidualBlock(cost.release(), losses_.back().get(), pose(v), camera(), intrinsicsBlock(),
                                  shape(bending_ ? v : static_cast<size_t>(corner.index)));
      }
    }
  }

  void holdIntrinsics() { problem_.SetParameterBlockConstant(intrinsicsBlock()); }

  bool solve() {
    ceres::Solver::Options options;
    // A direct solver, since iterative ones stop early on this badly conditioned problem (xi against gamma).
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.max_num_iterations = kMaxIterations;
    options.function_tolerance = 1e-12;
    options.parameter_tolerance = 1e-12;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    auto* ordering = new ceres::ParameterBlockOrdering;  // NOLINT: Ceres takes ownership
    for (size_t v = 0; v < num_views_; ++v) {
      ordering->AddElementToGroup(pose(v), 0);
    }
    ordering->AddElementToGroup(intrinsicsBlock(), 1);
    ordering->AddElementToGroup(camera(), 1);
    for (size_t s = 0; s < num_shapes_; ++s) {
      ordering->AddElementToGroup(shape(s), 1);
    }
    options.linear_solver_ordering.reset(ordering);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  std::vector<PosedBoard> boards() {
    std::vector<PosedBoard> boards;
    for (size_t v = 0; v < num_views_; ++v) {
      boards.push_back({fromPoseBlock(pose(v)).inverse(), Eigen::Vector3d::Zero()});
      if (bending_) {
        boards.back().bending_m = Eigen::Map<const Eigen::Vector3d>(shape(v));
      }
    }
    return boards;
  }
  Eigen::VectorXd intrinsics() {
    return Eigen::Map<const Eigen::VectorXd>(intrinsicsBlock(), num_intrinsics_);
  }

  std::optional<Eigen::MatrixXd> covariance() {
    ceres::Covariance::Options options;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> matrix(num_intrinsics_,
                                                                                  num_intrinsics_);
    const std::vector<std::pair<const double*, const double*>> blocks = {
        {intrinsicsBlock(), intrinsicsBlock()}};
    if (!covariance.Compute(blocks, &problem_) ||
        !covariance.GetCovarianceBlock(intrinsicsBlock(), intrinsicsBlock(), matrix.data())) {
      return std::nullopt;
    }
    return matrix;
  }

 private:
  static ceres::Problem::Options ownership() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  static constexpr int kPoseSize = 7;
  static void setPose(const RigidTransform& target_from_source, double* block) {
    const PoseBlock pose = toPoseBlock(target_from_source);
    std::copy(pose.begin(), pose.end(), block);
  }
  double* camera() { return blocks_.data(); }
  double* intrinsicsBlock() { return camera() + kPoseSize; }
  /// A view's bending where boards may be bent, otherwise a corner of the board.
  double* shape(size_t s) { return intrinsicsBlock() + num_intrinsics_ + 3 * s; }
  double* pose(size_t v) { return shape(num_shapes_) + kPoseSize * v; }

  std::unique_ptr<ceres::Manifold> manifold_;
  std::vector<std::unique_ptr<ceres::LossFunction>> losses_;  // one per view
  ceres::Problem problem_;
  const Eigen::Index num_intrinsics_;
  const size_t num_shapes_, num_views_;
  const bool bending_;
  std::vector<double> blocks_;
};

}  // namespace

Eigen::Vector2d reprojectionError(const CalibrationBoard& board, const BoardCorner& corner,
                                  const PosedBoard& posed, const CameraModel& model) {
  Eigen::Vector2d pixel;
  if (!model.project(posed.corner(board, corner.index), &pixel)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return pixel - corner.pixel;
}

std::optional<CameraModel> initialCamera(const std::string& model_name, cv::Size image_size_px,
                                         const CalibrationBoard& board, const std::vector<BoardView>& views) {
  constexpr int kSteps = 40;
  std::optional<CameraModel> best;
  double best_error = std::numeric_limits<double>::infinity();
  const size_t stride = std::max<size_t>(1, views.size() / kMaxInitialViews);
  for (int step = 0; step <= kSteps; ++step) {
    // Focal lengths from a fisheye lens of more than 180 degrees to a long lens.
    const double focal_px = image_size_px.width * 0.15 * std::pow(20.0, static_cast<double>(step) / kSteps);
    const CameraModel model =
        CameraModel::create(model_name, parametersFor(model_name, image_size_px, focal_px));
    double error = 0.0;
    bool any = false;
    for (size_t v = 0; v < views.size(); v += stride) {
      const auto pose = boardPose(board, views[v].corners, model);
      any = any || pose.has_value();
      for (const BoardCorner& corner : views[v].corners) {
        const double miss_px =
            pose.has_value()
                ? reprojectionError(board, corner, {*pose, Eigen::Vector3d::Zero()}, model).norm()
                : kMaxInitialError_px;
        error += std::isfinite(miss_px) ? std::min(miss_px, kMaxInitialError_px) : kMaxInitialError_px;
      }
    }
    if (any && error < best_error) {
      best_error = error;
      best = model;
    }
  }
  return best;
}

std::optional<FittedCamera> fitCamera(const CalibrationBoard& board, const std::vector<BoardView>& views,
                                      const CameraModel& initial, const FitSettings& settings) {
  FittedCamera start{initial, {}};
  for (const BoardView& view : views) {
    const auto pose = boardPose(board, view.corners, initial);
    if (!pose.has_value()) {
      return std::nullopt;
    }
    start.boards.push_back({*pose, Eigen::Vector3d::Zero()});
  }
  Adjustment adjustment(board, views, start, settings);
  if (!adjustment.solve()) {
    return std::nullopt;
  }
  return FittedCamera{CameraModel::create(initial.name(), adjustment.intrinsics()), adjustment.boards()};
}

std::optional<FittedCamera> fitFromScratch(const std::string& model_name, cv::Size image_size_px,
                                           const CalibrationBoard& board,
                                           const std::vector<BoardView>& views) {
  const Eigen::Vector2d middle(0.5 * (image_size_px.width - 1), 0.5 * (image_size_px.height - 1));
  const auto farthest_px = [&](const BoardView& view) {
    double distance_px = 0.0;
    for (const BoardCorner& corner : view.corners) {
      distance_px = std::max(distance_px, (corner.pixel - middle).norm());
    }
    return distance_px;
  };
  std::vector<BoardView> sorted = views;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const BoardView& a, const BoardView& b) { return farthest_px(a) < farthest_px(b); });
  std::optional<FittedCamera> fitted;
  for (size_t count = std::min(kFirstViews, sorted.size()); !sorted.empty();
       count = std::min(2 * count, sorted.size())) {
    const std::vector<BoardView> part(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(count));
    const auto start = fitted.has_value() ? std::optional<CameraModel>(fitted->model)
                                          : initialCamera(model_name, image_size_px, board, part);
    const auto next = start.has_value() ? fitCamera(board, part, *start, {Loss::kRobust}) : std::nullopt;
    if (next.has_value()) {
      fitted = next;
    }
    if (count == sorted.size()) {
      return next;
    }
  }
  return std::nullopt;
}

std::optional<PosedBoard> fitBoard(const CalibrationBoard& board, const BoardView& view,
                                   const CameraModel& model, const FitSettings& settings) {
  const auto pose = boardPose(board, view.corners, model);
  if (!pose.has_value()) {
    return std::nullopt;
  }
  Adjustment adjustment(board, {view}, {model, {{*pose, Eigen::Vector3d::Zero()}}}, settings);
  adjustment.holdIntrinsics();
  if (!adjustment.solve()) {
    return std::nullopt;
  }
  return adjustment.boards().front();
}

std::optional<Eigen::MatrixXd> intrinsicsCovariance(const CalibrationBoard& board,
                                                    const std::vector<BoardView>& views,
                                                    const FittedCamera& camera, const FitSettings& settings) {
  return Adjustment(board, views, camera, settings).covariance();
}

}  // namespace vcharge
