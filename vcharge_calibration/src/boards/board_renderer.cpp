#include "boards/board_renderer.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <string>

#include <opencv2/aruco.hpp>

namespace vcharge {

namespace {

constexpr double kDark = 25.0;
constexpr double kBright = 215.0;
constexpr double kWall = 110.0;
constexpr double kNoise = 2.0;
constexpr int kRays = 3;  // rays per pixel in each direction
constexpr int kTagCells = 10;

// Chessboard: squares around the inner corners, dark where column + row is even, with a bright margin.
double chessboardAt(const CalibrationBoard& board, const Eigen::Vector2d& p) {
  const double column = p.x() / board.square_m + 1.0;
  const double row = p.y() / board.square_m + 1.0;
  constexpr double kMargin = 0.4;
  if (column < -kMargin || row < -kMargin || column > board.columns + 1 + kMargin ||
      row > board.rows + 1 + kMargin) {
    return kWall;
  }
  if (column < 0.0 || row < 0.0 || column >= board.columns + 1 || row >= board.rows + 1) {
    return kBright;
  }
  return (static_cast<int>(column) + static_cast<int>(row)) % 2 == 0 ? kDark : kBright;
}

// Kalibr's grid: tags of 36h11 with borders of two cells, small dark squares at their corners.
class AprilGridTexture {
 public:
  explicit AprilGridTexture(const CalibrationBoard& board) : board_(board) {
    const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
    for (int id = 0; id < board.numCorners() / 4; ++id) {
      cv::Mat tag;
      cv::aruco::drawMarker(dictionary, id, kTagCells, tag, 2);
      tags_.push_back(tag);
    }
  }
  double at(const Eigen::Vector2d& p) const {
    const double pitch = 1.0 + board_.tag_spacing;
    const double x = p.x() / board_.square_m;
    const double y = p.y() / board_.square_m;
    const int tag_columns = board_.columns / 2;
    const int tag_rows = board_.rows / 2;
    const double margin = 2.0 * board_.tag_spacing;
    if (x < -margin || y < -margin || x > (tag_columns - 1) * pitch + 1.0 + margin ||
        y > (tag_rows - 1) * pitch + 1.0 + margin) {
      return kWall;
    }
    const int column = static_cast<int>(std::floor(x / pitch));
    const int row = static_cast<int>(std::floor(y / pitch));
    const double u = x - column * pitch;
    const double v = y - row * pitch;
    if (u < 1.0 && v < 1.0) {
      if (column < 0 || row < 0 || column >= tag_columns || row >= tag_rows) {
        return kBright;
      }
      // The board's y axis points up, the rows of the tag down.
      const cv::Mat& tag = tags_[static_cast<size_t>(row * tag_columns + column)];
      const int cell_row = std::clamp(static_cast<int>((1.0 - v) * kTagCells), 0, kTagCells - 1);
      const int cell_column = std::clamp(static_cast<int>(u * kTagCells), 0, kTagCells - 1);
      return tag.at<uint8_t>(cell_row, cell_column) == 0 ? kDark : kBright;
    }
    return u >= 1.0 && v >= 1.0 && column >= -1 && row >= -1 && column < tag_columns && row < tag_rows
               ? kDark
               : kBright;
  }

 private:
  const CalibrationBoard& board_;
  std::vector<cv::Mat> tags_;
};

/// kRays x kRays rays for each pixel of an image, in row-major order; zero where there is none.
std::vector<Eigen::Vector3f> raysOf(const CameraModel& model, cv::Size size) {
  std::vector<Eigen::Vector3f> rays;
  rays.reserve(static_cast<size_t>(size.area()) * kRays * kRays);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      for (int i = 0; i < kRays * kRays; ++i) {
        const int i_row = i / kRays;
        const Eigen::Vector2d pixel(column + (i % kRays + 0.5) / kRays - 0.5,
                                    row + (i_row + 0.5) / kRays - 0.5);
        Eigen::Vector3d ray;
        rays.push_back(model.unproject(pixel, &ray) ? ray.cast<float>().eval() : Eigen::Vector3f::Zero());
      }
    }
  }
  return rays;
}

template <class Texture>
cv::Mat render(const std::vector<Eigen::Vector3f>& rays, cv::Size size,
               const RigidTransform& camera_from_board, uint64_t seed, const Texture& texture) {
  const RigidTransform board_from_camera = camera_from_board.inverse();
  const Eigen::Matrix3d rotation = board_from_camera.rotationMatrix();
  const Eigen::Vector3d& eye = board_from_camera.translation();
  cv::Mat image(size, CV_8UC1);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  size_t next = 0;
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      double sum = 0.0;
      for (int i = 0; i < kRays * kRays; ++i) {
        const Eigen::Vector3d direction = rotation * rays[next++].cast<double>();
        const double along = direction.z() == 0.0 ? -1.0 : -eye.z() / direction.z();
        sum += along > 0.0 ? texture((eye + along * direction).template head<2>()) : kWall;
      }
      const double value = sum / (kRays * kRays) + noise(random);
      image.at<uint8_t>(row, column) = static_cast<uint8_t>(std::clamp(std::lround(value), 0L, 255L));
    }
  }
  return image;
}

}  // namespace

std::vector<RigidTransform> boardPoses(const CalibrationBoard& board, const CameraModel& model,
                                       cv::Size image_size_px, int count, const PoseRange& range,
                                       uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const Eigen::Vector3d middle_of_board = 0.5 * board.corner(board.numCorners() - 1);
  // An AprilGrid's y axis points up.
  const Eigen::Quaterniond upright =
      board.pattern == BoardPattern::kAprilGrid
          ? Eigen::Quaterniond(Eigen::AngleAxisd(3.14159265358979, Eigen::Vector3d::UnitX()))
          : Eigen::Quaterniond::Identity();
  std::vector<RigidTransform> poses;
  while (static_cast<int>(poses.size()) < count) {
    const double angle_rad = range.max_angle_rad * std::sqrt(uniform(0.0, 1.0));
    const double azimuth_rad = uniform(-3.14159265, 3.14159265);
    const double roll_rad = uniform(-0.4, 0.4);
    const double tilt_x_rad = uniform(-0.6, 0.6);
    const double tilt_y_rad = uniform(-0.6, 0.6);
    const double distance_m = range.distance_m * uniform(0.8, 1.3);
    const Eigen::Vector3d direction(std::sin(angle_rad) * std::cos(azimuth_rad),
                                    std::sin(angle_rad) * std::sin(azimuth_rad), std::cos(angle_rad));
    const Eigen::Quaterniond rotation =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction) *
        rotationFromYawPitchRoll(roll_rad, tilt_y_rad, tilt_x_rad) * upright;
    const RigidTransform pose(rotation, distance_m * direction - rotation * middle_of_board);
    int seen = 0;
    for (int i = 0; i < board.numCorners(); ++i) {
      constexpr double kMargin_px = 8.0;
      Eigen::Vector2d pixel;
      seen += model.project(pose * board.corner(i), &pixel) && pixel.x() > kMargin_px &&
                      pixel.y() > kMargin_px && pixel.x() < image_size_px.width - kMargin_px &&
                      pixel.y() < image_size_px.height - kMargin_px
                  ? 1
                  : 0;
    }
    if (seen >= range.min_visible_fraction * board.numCorners()) {
      poses.push_back(pose);
    }
  }
  return poses;
}

std::vector<CalibrationImage> renderBoards(const CalibrationBoard& board, const CameraModel& model,
                                           cv::Size image_size_px, const std::vector<RigidTransform>& poses) {
  const std::vector<Eigen::Vector3f> rays = raysOf(model, image_size_px);
  std::optional<AprilGridTexture> grid;
  if (board.pattern == BoardPattern::kAprilGrid) {
    grid.emplace(board);
  }
  const auto texture = [&](const Eigen::Vector2d& p) {
    return grid.has_value() ? grid->at(p) : chessboardAt(board, p);
  };
  std::vector<CalibrationImage> images;
  for (size_t i = 0; i < poses.size(); ++i) {
    images.push_back({"image" + std::to_string(i), render(rays, image_size_px, poses[i], i + 1, texture)});
  }
  return images;
}

}  // namespace vcharge
