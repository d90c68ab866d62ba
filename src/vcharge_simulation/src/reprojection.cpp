#include "reprojection.h"

#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/camera_response.h"

namespace vcharge {

namespace {

const double kMinCosine = std::cos(75.0 * 3.14159265358979323846 / 180.0);
constexpr double kMinResolution = 0.8;
constexpr double kMaxRangeError = 0.03;  // share of the range
constexpr double kMaxRelief_px = 0.25;   // of `first`
constexpr int kSamples = 4;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Of one picture's pixels in another one.
class Comparison {
 public:
  Comparison(const Picture& first, const Picture& second)
      : first_(first),
        second_(second),
        second_from_first_(second.world_from_camera.inverse() * first.world_from_camera),
        points_(static_cast<size_t>(first.gray.size().area()), Eigen::Vector3d::Constant(kNaN)) {
    for (int y = 0; y < first.gray.rows; ++y) {
      for (int x = 0; x < first.gray.cols; ++x) {
        Eigen::Vector3d ray;
        if (!std::isnan(first.range_m.at<float>(y, x)) && first.camera.unproject({x, y}, &ray)) {
          points_[index(x, y)] = first.range_m.at<float>(y, x) * ray;
        }
      }
    }
  }

  // Gray of `second` over the part of the surface that a pixel of `first` (not on its border) shows.
  std::optional<double> grayOfSecond(int x, int y) const {
    const Eigen::Vector3d& here = points_[index(x, y)];
    const Eigen::Vector3d normal =
        (points_[index(x + 1, y)] - points_[index(x - 1, y)])
            .cross(points_[index(x, y + 1)] - points_[index(x, y - 1)])
            .normalized();
    const Eigen::Vector3d there = second_from_first_ * here;
    const Eigen::Vector3d normal_there = second_from_first_.rotation() * normal;
    // Also false where a range is missing.
    const bool faces_both = std::abs(normal.dot(here.normalized())) > kMinCosine &&
                            std::abs(normal_there.dot(there.normalized())) > kMinCosine &&
                            here.z() > kMinCosine * here.norm() && there.z() > kMinCosine * there.norm();
    Eigen::Vector2d pixel;
    if (!faces_both || !second_.camera.project(there, &pixel)) {
      return std::nullopt;
    }
    const std::optional<Eigen::Matrix2d> footprint = findFootprint(x, y, pixel);
    // A view that is coarser in any direction cannot reproduce a finer one; a finer one is averaged.
    if (!footprint ||
        Eigen::JacobiSVD<Eigen::Matrix2d>(*footprint).singularValues().y() < kMinResolution) {
      return std::nullopt;
    }
    double gray = 0.0;
    for (int k = 0; k < kSamples * kSamples; ++k) {
      const Eigen::Vector2d sample(k % kSamples, k / kSamples);  // NOLINT: whole column and row
      const Eigen::Vector2d offset = (sample.array() + 0.5) / kSamples - 0.5;
      const std::optional<double> value = interpolate(pixel + *footprint * offset, there.norm());
      if (!value) {
        return std::nullopt;
      }
      gray += *value / (kSamples * kSamples);
    }
    return gray;
  }

 private:
  size_t index(int x, int y) const { return static_cast<size_t>(y) * first_.gray.cols + x; }

  // What one pixel of `first` covers in `second`, where its neighbours are parts of the same surface.
  std::optional<Eigen::Matrix2d> findFootprint(int x, int y, const Eigen::Vector2d& pixel) const {
    Eigen::Matrix<double, 2, 9> around;
    for (int k = 0; k < 9; ++k) {
      Eigen::Vector2d at;
      const Eigen::Vector3d& neighbour = points_[index(x + k % 3 - 1, y + k / 3 - 1)];
      if (!neighbour.allFinite() || !second_.camera.project(second_from_first_ * neighbour, &at)) {
        return std::nullopt;
      }
      around.col(k) = at;
    }
    Eigen::Matrix2d footprint;
    footprint << 0.5 * (around.col(5) - around.col(3)), 0.5 * (around.col(7) - around.col(1));
    const Eigen::Matrix2d first_from_second = footprint.inverse();
    for (int k = 0; k < 9; ++k) {
      const Eigen::Vector2d step(k % 3 - 1, k / 3 - 1);  // NOLINT: whole column and row
      if (!((first_from_second * (around.col(k) - pixel) - step).norm() < kMaxRelief_px)) {
        return std::nullopt;
      }
    }
    return footprint;
  }

  // Between the four pixels about a place in `second`, if all of them see the surface at `range_m`.
  std::optional<double> interpolate(const Eigen::Vector2d& at, double range_m) const {
    const int column = static_cast<int>(std::floor(at.x()));
    const int row = static_cast<int>(std::floor(at.y()));
    if (column < 0 || row < 0 || column + 1 >= second_.gray.cols || row + 1 >= second_.gray.rows) {
      return std::nullopt;
    }
    double gray = 0.0;
    for (int k = 0; k < 4; ++k) {
      const int x = column + k % 2;
      const int y = row + k / 2;
      if (!(std::abs(second_.range_m.at<float>(y, x) - range_m) < kMaxRangeError * range_m)) {
        return std::nullopt;
      }
      gray += (1.0 - std::abs(at.x() - x)) * (1.0 - std::abs(at.y() - y)) * second_.gray.at<uint8_t>(y, x);
    }
    return gray;
  }

  const Picture& first_;
  const Picture& second_;
  const RigidTransform second_from_first_;
  std::vector<Eigen::Vector3d> points_;  // of `first`'s pixels, in its frame
};

bool showsCar(const Renderer& renderer, const Picture& picture, int x, int y) {
  Eigen::Vector3d ray;
  SurfaceKind kind = SurfaceKind::kOther;
  return picture.camera.unproject({x, y}, &ray) &&
         renderer.castRay(picture.world_from_camera.translation(), picture.world_from_camera.rotation() * ray,
                          0.0, &kind) &&
         kind == SurfaceKind::kCar;
}

}  // namespace

Picture takePicture(const Renderer& renderer, const Sighting& sighting) {
  const CameraView& view = sighting.view;
  const RigidTransform world_from_camera = sighting.world_from_vehicle * *view.camera().vehicle_from_camera;
  // The same surface passes other parts of each lens.
  cv::Mat flat;
  cv::divide(renderer.renderLight(view, sighting.world_from_vehicle, sighting.time_s),
             cv::max(view.vignette(), 0.05), flat);
  return {CameraResponse().develop(flat),
          renderer.renderRange(view, sighting.world_from_vehicle, sighting.time_s), view.camera().model,
          world_from_camera};
}

Reprojection reproject(const Renderer& renderer, const Picture& first, const Picture& second,
                       Surfaces surfaces) {
  const Comparison comparison(first, second);
  const cv::Size size = first.gray.size();
  cv::Mat moved(size, CV_32FC1, cv::Scalar(kNaN));  // `second` as `first` would see it
  for (int y = 1; y + 1 < size.height; ++y) {
    for (int x = 1; x + 1 < size.width; ++x) {
      const std::optional<double> gray = comparison.grayOfSecond(x, y);
      if (gray && (surfaces == Surfaces::kAll || !showsCar(renderer, first, x, y))) {
        moved.at<float>(y, x) = static_cast<float>(*gray);
      }
    }
  }
  Reprojection result;
  // Of the fit difference = gradient * shift + brightness.
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (int y = 1; y + 1 < size.height; ++y) {
    for (int x = 1; x + 1 < size.width; ++x) {
      double difference = 0.0;
      Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  // of the mean of both images
      for (int k = 0; k < 9; ++k) {
        const Eigen::Vector2d step(k % 3 - 1, k / 3 - 1);  // NOLINT: whole column and row
        const double one = first.gray.at<uint8_t>(y + k / 3 - 1, x + k % 3 - 1);
        const double other = moved.at<float>(y + k / 3 - 1, x + k % 3 - 1);
        difference += (other - one) / 9.0;
        gradient += step * (0.5 * (one + other) / 6.0);
      }
      if (std::isnan(difference)) {
        continue;
      }
      ++result.count;
      result.mean_difference += std::abs(difference);
      result.mean_pixel_difference += std::abs(moved.at<float>(y, x) - first.gray.at<uint8_t>(y, x));
      const Eigen::Vector3d row(gradient.x(), gradient.y(), 1.0);
      normal_matrix += row * row.transpose();
      right_side += row * difference;
    }
  }
  if (result.count > 0) {
    result.mean_difference /= result.count;
    result.mean_pixel_difference /= result.count;
    result.shift_px = normal_matrix.ldlt().solve(right_side).head<2>();
  }
  return result;
}

}  // namespace vcharge
