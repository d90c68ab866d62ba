#include "vcharge_features/patch_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "vcharge_core/frames/bilinear_sample.h"

namespace vcharge {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Patches with less contrast (standard deviation in gray levels) have no texture.
constexpr float kMinContrast = 2.0F;
constexpr int kMaxIterations = 20;
/// Smaller steps end the iterations.
constexpr double kMinStep_px = 0.005;
/// Standard deviation of the difference between pixels, which weights the prior of the shape.
constexpr double kNoise_gray = 4.0;
/// Interpolation between pixels moves a patch this far, even without noise.
constexpr double kInterpolationSigma_px = 0.05;
/// Differences between neighbouring pixels of a patch are alike: positions err by this factor more than if
/// they were independent (measured at the true poses of simulated drives, the same for good and bad patches).
constexpr double kCorrelationFactor = 1.4;
/// Largest factor by which a patch may grow or shrink in any direction.
constexpr double kMaxScale = 2.0;

/// Whether the deformed square of this radius lies inside the image, with a margin of one pixel.
bool isInside(const cv::Mat& image, const PatchWarp& warp, double radius_px) {
  const Eigen::Vector2d reach_px = warp.shape.cwiseAbs() * Eigen::Vector2d::Constant(radius_px);
  const Eigen::Vector2d low_px = warp.position_px - reach_px, high_px = warp.position_px + reach_px;
  return low_px.minCoeff() >= 1.0 && high_px.x() < image.cols - 2.0 && high_px.y() < image.rows - 2.0;
}

class Alignment {
 public:
  Alignment(const PatchAlignmentOptions& options, const cv::Mat& current)
      : options_(options), current_(current), side_(2 * options.radius_px + 1), size_(side_ * side_) {}

  /// False if the patch leaves the image or has no texture.
  bool setAnchor(const cv::Mat& image, const Eigen::Vector2d& anchor_px) {
    const PatchWarp warp{anchor_px, Eigen::Matrix2d::Identity()};
    if (!isInside(image, warp, options_.radius_px + 1.0)) {
      return false;
    }
    anchor_ = read(image, warp);
    contrast_ = normalize(&anchor_);
    if (contrast_ < kMinContrast) {
      return false;
    }
    jacobian_.resize(size_, 6);
    for (int i = 0; i < size_; ++i) {
      const Eigen::Vector2f offset = offsetOf(i);
      const Eigen::Vector2f at = anchor_px.cast<float>() + offset;
      const float by_x =
          0.5F * (bilinearSample(image, at.x() + 1, at.y()) - bilinearSample(image, at.x() - 1, at.y()));
      const float by_y =
          0.5F * (bilinearSample(image, at.x(), at.y() + 1) - bilinearSample(image, at.x(), at.y() - 1));
      jacobian_.row(i) << by_x, by_y, by_x * offset.x(), by_x * offset.y(), by_y * offset.x(),
          by_y * offset.y();
    }
    // Changes of brightness and contrast are projected out.
    jacobian_.rowwise() -= jacobian_.colwise().mean().eval();
    const Eigen::Matrix<float, 1, 6> as_contrast =
        anchor_.transpose() * jacobian_ / static_cast<float>(size_);
    jacobian_ -= anchor_ * as_contrast;
    Matrix6 information = (jacobian_.transpose() * jacobian_).cast<double>();
    information.diagonal().tail<4>().array() += shapeWeight();
    solver_.compute(information);
    return solver_.info() == Eigen::Success && solver_.rcond() > 1e-9;
  }

  std::optional<AlignedPatch> align(const PatchWarp& start) const {
    AlignedPatch warp{start, 0.0};
    const Eigen::Matrix2d start_inverse = start.shape.inverse();
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      if (!isInside(current_, warp, options_.radius_px)) {
        return std::nullopt;
      }
      Eigen::VectorXf patch = read(current_, warp);
      if (normalize(&patch) < kMinContrast) {
        return std::nullopt;
      }
      const Vector6 step = stepFor(patch, start_inverse * warp.shape - Eigen::Matrix2d::Identity());
      // The step deforms the anchor; the current patch is deformed by its inverse.
      const Eigen::Matrix2d change = Eigen::Matrix2d::Identity() + shapeOf(step);
      if (!step.allFinite() || change.determinant() < 0.1) {
        return std::nullopt;
      }
      warp.shape = warp.shape * change.inverse();
      const Eigen::Vector2d move_px = warp.shape * step.head<2>();
      warp.position_px -= move_px;
      const double rim_move_px = options_.radius_px * step.tail<4>().norm();
      if (move_px.norm() < kMinStep_px && rim_move_px < 4.0 * kMinStep_px) {
        if (!isGood(patch, warp)) {
          return std::nullopt;
        }
        warp.sigma_px = positionSigma(patch);
        return warp;
      }
    }
    return std::nullopt;
  }

 private:
  Eigen::Vector2f offsetOf(int i) const {
    const int row = i / side_, column = i % side_;
    return Eigen::Vector2f(static_cast<float>(column - options_.radius_px),
                           static_cast<float>(row - options_.radius_px));
  }

  static Eigen::Matrix2d shapeOf(const Vector6& step) {
    return (Eigen::Matrix2d() << step[2], step[3], step[4], step[5]).finished();
  }

  double shapeWeight() const {
    const double ratio = kNoise_gray / options_.shape_sigma;
    return ratio * ratio;
  }

  Eigen::VectorXf read(const cv::Mat& image, const PatchWarp& warp) const {
    Eigen::VectorXf patch(size_);
    const Eigen::Matrix2f shape = warp.shape.cast<float>();
    const Eigen::Vector2f center = warp.position_px.cast<float>();
    for (int i = 0; i < size_; ++i) {
      const Eigen::Vector2f at = center + shape * offsetOf(i);
      patch[i] = bilinearSample(image, at.x(), at.y());
    }
    return patch;
  }

  /// Normalizes to mean 0 and standard deviation 1; returns the original standard deviation.
  static float normalize(Eigen::VectorXf* patch) {
    patch->array() -= patch->mean();
    const float contrast = std::sqrt(patch->squaredNorm() / static_cast<float>(patch->size()));
    *patch /= std::max(contrast, 1e-3F);
    return contrast;
  }

  Vector6 stepFor(const Eigen::VectorXf& patch, const Eigen::Matrix2d& deviation) const {
    Vector6 gradient = (jacobian_.transpose() * (contrast_ * (patch - anchor_))).cast<double>();
    gradient.tail<4>() +=
        shapeWeight() * Eigen::Vector4d(deviation(0, 0), deviation(0, 1), deviation(1, 0), deviation(1, 1));
    return solver_.solve(gradient);
  }

  double positionSigma(const Eigen::VectorXf& patch) const {
    const double difference_gray =
        contrast_ * (patch - anchor_).norm() / std::sqrt(static_cast<double>(size_));
    const Matrix6 covariance = solver_.solve(Matrix6::Identity());  // of pixels with a deviation of 1
    const double px_per_gray = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
    return std::hypot(kInterpolationSigma_px, kCorrelationFactor * px_per_gray * difference_gray);
  }

  bool isGood(const Eigen::VectorXf& patch, const PatchWarp& warp) const {
    return anchor_.dot(patch) / static_cast<float>(size_) >= options_.min_correlation &&
           isSamePatch(warp.shape);
  }

  const PatchAlignmentOptions& options_;
  const cv::Mat& current_;
  const int side_, size_;
  Eigen::VectorXf anchor_;  // normalized
  float contrast_ = 0.0F;   // standard deviation of the anchor in gray levels
  Eigen::Matrix<float, Eigen::Dynamic, 6>
      jacobian_;  // gray levels by position and shape in the anchor's image
  Eigen::LDLT<Matrix6> solver_;
};

}  // namespace

bool isSamePatch(const Eigen::Matrix2d& shape) {
  const Eigen::Vector2d scales = Eigen::JacobiSVD<Eigen::Matrix2d>(shape).singularValues();
  return scales[0] <= kMaxScale && scales[1] * kMaxScale >= 1.0;
}

std::optional<AlignedPatch> alignPatch(const cv::Mat& anchor, const cv::Mat& current,
                                       const Eigen::Vector2d& anchor_px, const PatchWarp& start,
                                       const PatchAlignmentOptions& options) {
  if (anchor.empty() || current.empty()) {
    return std::nullopt;
  }
  Alignment alignment(options, current);
  return alignment.setAnchor(anchor, anchor_px) ? alignment.align(start) : std::nullopt;
}

}  // namespace vcharge
