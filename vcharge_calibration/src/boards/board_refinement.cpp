#include "boards/board_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

namespace vcharge {

namespace {

// Half widths of the window relative to the distance to the next other edge; the largest that fits is used.
constexpr std::array<double, 3> kWindows = {0.5, 0.35, 0.25};
constexpr int kMinSteps = 4;
constexpr int kMaxSteps = 40;
constexpr int kMaxIterations = 30;
constexpr double kConverged_px = 1e-3;
constexpr double kMinCorrelation = 0.6;
constexpr double kMinContrast = 3.0;  // gray levels; a smaller standard deviation is only noise

cv::Mat toFloat(const cv::Mat& image) {
  cv::Mat result;
  image.convertTo(result, CV_32F);
  return result;
}

}  // namespace

/// Samples of the board's plane around a corner, about a pixel apart: (2 nx + 1) x (2 ny + 1), plus one on
/// each side for gradients.
struct BoardRefiner::Patch {
  int nx = 0, ny = 0;
  double step_x_m = 0.0, step_y_m = 0.0;
  cv::Mat map;                  // CV_32FC2, pixels
  Eigen::Vector2d predicted;    // corner
  Eigen::Matrix2d pixels_by_m;  // derivative at the corner
};

BoardRefiner::BoardRefiner(const cv::Mat& image, const CalibrationBoard& board, const CameraModel& model,
                           const PosedBoard& posed)
    : image_(toFloat(image)), board_(board), model_(model), posed_(posed) {}

std::optional<Eigen::Vector2d> BoardRefiner::predict(int index) const {
  Eigen::Vector2d pixel;
  if (!model_.project(posed_.corner(board_, index), &pixel)) {
    return std::nullopt;
  }
  return pixel;
}

std::optional<BoardRefiner::Patch> BoardRefiner::cut(int index, double half_m) const {
  const Eigen::Vector2d corner = board_.corner(index).head<2>();
  const auto project = [&](double x_m, double y_m, Eigen::Vector2d* pixel) {
    return model_.project(posed_.point(board_, corner + Eigen::Vector2d(x_m, y_m)), pixel);
  };
  Patch patch;
  Eigen::Vector2d left;
  Eigen::Vector2d right;
  Eigen::Vector2d above;
  Eigen::Vector2d below;
  if (!project(0.0, 0.0, &patch.predicted) || !project(-half_m, 0.0, &left) ||
      !project(half_m, 0.0, &right) || !project(0.0, -half_m, &above) || !project(0.0, half_m, &below)) {
    return std::nullopt;
  }
  patch.pixels_by_m << (right - left) / (2.0 * half_m), (below - above) / (2.0 * half_m);
  const auto steps = [](double length_px) {
    return std::clamp(static_cast<int>(std::ceil(0.5 * length_px)), kMinSteps, kMaxSteps);
  };
  patch.nx = steps((right - left).norm());
  patch.ny = steps((below - above).norm());
  patch.step_x_m = half_m / patch.nx;
  patch.step_y_m = half_m / patch.ny;
  patch.map.create(2 * patch.ny + 3, 2 * patch.nx + 3, CV_32FC2);
  bool seen = true;
  model_.visit([&](const auto& model) {
    for (int row = 0; row < patch.map.rows && seen; ++row) {
      auto* line = patch.map.ptr<cv::Vec2f>(row);
      const double y_m = (row - patch.ny - 1) * patch.step_y_m;
      for (int column = 0; column < patch.map.cols && seen; ++column) {
        const double x_m = (column - patch.nx - 1) * patch.step_x_m;
        Eigen::Vector2d pixel;
        seen = model.project(posed_.point(board_, corner + Eigen::Vector2d(x_m, y_m)), &pixel);
        line[column] = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
      }
    }
  });
  return seen ? std::optional<Patch>(patch) : std::nullopt;
}

std::optional<Eigen::Vector2d> BoardRefiner::refine(int index, const Eigen::Vector2d& start,
                                                    double max_move_px) const {
  for (const double window : kWindows) {
    const auto patch = cut(index, window * board_.clearance_m());
    if (!patch.has_value()) {
      continue;
    }
    Eigen::Vector2d at = start;
    bool inside = true;
    double correlation = 0.0;
    double last_move_px = 0.0;
    for (int iteration = 0; iteration < kMaxIterations && inside; ++iteration) {
      const Eigen::Vector2d shift = at - patch->predicted;
      cv::Mat map;
      cv::add(patch->map, cv::Scalar(shift.x(), shift.y()), map);
      cv::Mat channels[2];
      cv::split(map, channels);
      double low_x = 0.0, high_x = 0.0, low_y = 0.0, high_y = 0.0;
      cv::minMaxLoc(channels[0], &low_x, &high_x);
      cv::minMaxLoc(channels[1], &low_y, &high_y);
      inside = low_x >= 1.0 && low_y >= 1.0 && high_x <= image_.cols - 2.0 && high_y <= image_.rows - 2.0;
      if (!inside) {
        break;
      }
      cv::Mat values;
      cv::remap(image_, values, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
      // The corner c solves sum w g g^T (b - c) = 0, with samples at b (metres from the corner), gradients g.
      Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
      Eigen::Vector2d right_side = Eigen::Vector2d::Zero();
      double sum = 0.0, sum_squared = 0.0, product = 0.0;
      for (int row = 1; row + 1 < values.rows; ++row) {
        const auto* above = values.ptr<float>(row - 1);
        const auto* line = values.ptr<float>(row);
        const auto* below = values.ptr<float>(row + 1);
        const double t = static_cast<double>(row - patch->ny - 1) / (patch->ny + 1);
        for (int column = 1; column + 1 < values.cols; ++column) {
          const double s = static_cast<double>(column - patch->nx - 1) / (patch->nx + 1);
          const double weight = (1.0 - s * s) * (1.0 - t * t);
          const Eigen::Vector2d g((line[column + 1] - line[column - 1]) / patch->step_x_m,
                                  (below[column] - above[column]) / patch->step_y_m);
          const Eigen::Vector2d b((column - patch->nx - 1) * patch->step_x_m,
                                  (row - patch->ny - 1) * patch->step_y_m);
          const Eigen::Vector2d weighted = weight * g;
          normal += weighted * g.transpose();
          right_side += weighted * g.dot(b);
          const double value = line[column];
          sum += value;
          sum_squared += value * value;
          product += (s > 0.0) == (t > 0.0) ? value : -value;
        }
      }
      const double count = static_cast<double>(values.rows - 2) * (values.cols - 2);
      const double variance = sum_squared / count - sum * sum / (count * count);
      correlation =
          variance < kMinContrast * kMinContrast ? 0.0 : std::abs(product) / count / std::sqrt(variance);
      const Eigen::Vector2d move_px = patch->pixels_by_m * (normal.inverse() * right_side);
      if (!move_px.allFinite()) {
        return std::nullopt;
      }
      at += move_px;
      last_move_px = move_px.norm();
      if ((at - start).norm() > max_move_px) {
        return std::nullopt;
      }
      if (last_move_px < kConverged_px) {
        break;
      }
    }
    if (!inside) {
      continue;
    }
    if (correlation < kMinCorrelation || last_move_px > 0.05) {
      return std::nullopt;
    }
    return at;
  }
  return std::nullopt;
}

}  // namespace vcharge
