#include "intrinsic_optimizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <ceres/ceres.h>

#include "board_pose.h"
#include "vcharge_geometry/pose_block.h"
#include "vcharge_geometry/rig_costs.h"

namespace vcharge {

namespace {

constexpr int kMaxIterations = 200;
constexpr double kRobust_px = 1.0;
// A guess is judged by views' errors up to this size.
constexpr double kMaxGuessError_px = 20.0;
constexpr size_t kMaxGuessViews = 20;
constexpr size_t kFirstViews = 8;

Eigen::VectorXd parametersFor(const std::string& model_name, cv::Size size, double focal_px) {
  const double u0 = 0.5 * (size.width - 1);
  const double v0 = 0.5 * (size.height - 1);
  Eigen::VectorXd parameters =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(CameraModel::parameterNames(model_name).size()));
  if (model_name == MeiCamera::kName) {
    // Near the axis a Mei camera has the focal length gamma / (1 + xi).
    parameters.head<5>() << 1.0, 2.0 * focal_px, 2.0 * focal_px, u0, v0;
  } else {
    parameters.head<4>() << focal_px, focal_px, u0, v0;
  }
  return parameters;
}

/// The bundle adjustment's blocks: inverse poses play the vehicle, the camera sits in its origin.
class Adjustment {
 public:
  Adjustment(const Chessboard& board, const std::vector<BoardView>& views, const FittedCamera& start,
             Loss loss, double sigma_px)
      : manifold_(makePoseManifold()), problem_(ownership()), camera_(toPoseBlock(RigidTransform())) {
    intrinsics_ = start.model.parameters();
    for (int i = 0; i < board.numCorners(); ++i) {
      corners_.push_back(board.corner(i));
    }
    problem_.AddParameterBlock(camera_.data(), 7);
    problem_.SetParameterBlockConstant(camera_.data());
    problem_.AddParameterBlock(intrinsics_.data(), static_cast<int>(intrinsics_.size()));
    for (Eigen::Vector3d& corner : corners_) {
      problem_.AddParameterBlock(corner.data(), 3);
      problem_.SetParameterBlockConstant(corner.data());
    }
    for (const RigidTransform& pose : start.camera_from_board) {
      poses_.push_back(toPoseBlock(pose.inverse()));
    }
    if (loss == Loss::kRobust) {
      loss_ = std::make_unique<ceres::HuberLoss>(kRobust_px);
    }
    for (size_t v = 0; v < views.size(); ++v) {
      problem_.AddParameterBlock(poses_[v].data(), 7, manifold_.get());
      for (const BoardCorner& corner : views[v].corners) {
        problem_.AddResidualBlock(makeReprojectionCost(start.model, corner.pixel, sigma_px).release(),
                                  loss_.get(), poses_[v].data(), camera_.data(), intrinsics_.data(),
                                  corners_[static_cast<size_t>(corner.index)].data());
      }
    }
  }

  void holdIntrinsics() { problem_.SetParameterBlockConstant(intrinsics_.data()); }

  bool solve() {
    ceres::Solver::Options options;
    // Exact: iterative solvers stop early on a problem this badly conditioned (xi against gamma).
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.max_num_iterations = kMaxIterations;
    options.function_tolerance = 1e-12;
    options.parameter_tolerance = 1e-12;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    auto* ordering = new ceres::ParameterBlockOrdering;  // NOLINT: Ceres takes it
    for (PoseBlock& pose : poses_) {
      ordering->AddElementToGroup(pose.data(), 0);
    }
    ordering->AddElementToGroup(intrinsics_.data(), 1);
    ordering->AddElementToGroup(camera_.data(), 1);
    for (Eigen::Vector3d& corner : corners_) {
      ordering->AddElementToGroup(corner.data(), 1);
    }
    options.linear_solver_ordering.reset(ordering);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  std::vector<RigidTransform> poses() const {
    std::vector<RigidTransform> poses;
    for (const PoseBlock& block : poses_) {
      poses.push_back(fromPoseBlock(block).inverse());
    }
    return poses;
  }
  const Eigen::VectorXd& intrinsics() const { return intrinsics_; }

  std::optional<Eigen::MatrixXd> covariance() {
    ceres::Covariance::Options options;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    const auto size = intrinsics_.size();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> matrix(size, size);
    const std::vector<std::pair<const double*, const double*>> blocks = {
        {intrinsics_.data(), intrinsics_.data()}};
    if (!covariance.Compute(blocks, &problem_) ||
        !covariance.GetCovarianceBlock(intrinsics_.data(), intrinsics_.data(), matrix.data())) {
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

  std::unique_ptr<ceres::Manifold> manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;
  ceres::Problem problem_;
  PoseBlock camera_;
  Eigen::VectorXd intrinsics_;
  std::vector<Eigen::Vector3d> corners_;
  std::vector<PoseBlock> poses_;
};

}  // namespace

Eigen::Vector2d reprojectionError(const Chessboard& board, const BoardCorner& corner,
                                  const RigidTransform& camera_from_board, const CameraModel& model) {
  Eigen::Vector2d pixel;
  if (!model.project(camera_from_board * board.corner(corner.index), &pixel)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return pixel - corner.pixel;
}

std::optional<CameraModel> guessCamera(const std::string& model_name, cv::Size image_size_px,
                                       const Chessboard& board, const std::vector<BoardView>& views) {
  constexpr int kSteps = 40;
  std::optional<CameraModel> best;
  double best_error = std::numeric_limits<double>::infinity();
  const size_t stride = std::max<size_t>(1, views.size() / kMaxGuessViews);
  for (int step = 0; step <= kSteps; ++step) {
    // From a fisheye of more than 180 degrees to a long lens.
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
            pose.has_value() ? reprojectionError(board, corner, *pose, model).norm() : kMaxGuessError_px;
        error += std::isfinite(miss_px) ? std::min(miss_px, kMaxGuessError_px) : kMaxGuessError_px;
      }
    }
    if (any && error < best_error) {
      best_error = error;
      best = model;
    }
  }
  return best;
}

std::optional<FittedCamera> fitCamera(const Chessboard& board, const std::vector<BoardView>& views,
                                      const CameraModel& initial, Loss loss) {
  FittedCamera start{initial, {}};
  for (const BoardView& view : views) {
    const auto pose = boardPose(board, view.corners, initial);
    if (!pose.has_value()) {
      return std::nullopt;
    }
    start.camera_from_board.push_back(*pose);
  }
  Adjustment adjustment(board, views, start, loss, 1.0);
  if (!adjustment.solve()) {
    return std::nullopt;
  }
  return FittedCamera{CameraModel::create(initial.name(), adjustment.intrinsics()), adjustment.poses()};
}

std::optional<FittedCamera> fitFromScratch(const std::string& model_name, cv::Size image_size_px,
                                           const Chessboard& board, const std::vector<BoardView>& views) {
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
                                          : guessCamera(model_name, image_size_px, board, part);
    const auto next = start.has_value() ? fitCamera(board, part, *start, Loss::kRobust) : std::nullopt;
    if (next.has_value()) {
      fitted = next;
    }
    if (count == sorted.size()) {
      return next;
    }
  }
  return std::nullopt;
}

std::optional<RigidTransform> fitPose(const Chessboard& board, const BoardView& view,
                                      const CameraModel& model) {
  const auto pose = boardPose(board, view.corners, model);
  if (!pose.has_value()) {
    return std::nullopt;
  }
  Adjustment adjustment(board, {view}, {model, {*pose}}, Loss::kRobust, 1.0);
  adjustment.holdIntrinsics();
  if (!adjustment.solve()) {
    return std::nullopt;
  }
  return adjustment.poses().front();
}

std::optional<Eigen::MatrixXd> intrinsicsCovariance(const Chessboard& board,
                                                    const std::vector<BoardView>& views,
                                                    const FittedCamera& camera, double sigma_px) {
  return Adjustment(board, views, camera, Loss::kSquared, sigma_px).covariance();
}

}  // namespace vcharge
