#include "sweep/surface_memory.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>
#include <Eigen/Core>

#include "kernels/pooled_mat.h"
#include "sweep/coarse_pass.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Every tile is swept in full once in this number of sweeps.
constexpr uint32_t kPeriod = 6;
// The prediction and the coarse pass agree within this number of its planes.
constexpr float kAgreement = 1.5F;
// A prediction is believed in a tile if it covers this fraction of the pixels with texture, and this fraction
// of the confident ones agrees.
constexpr double kMinCovered = 0.6, kMinAgreeing = 0.8;
// Beside a jump both surfaces must be swept, or the nearer one grows from image to image: fraction of the
// covered pixels that may have one, within this distance, of at least this number of the coarse pass's
// planes.
constexpr double kMaxJumps = 0.02;
constexpr int kJumpReach_px = 4;
constexpr float kJump = 2.0F;
// Lower than any correlation.
constexpr float kNoCorrelation = -2.0F;

}  // namespace

SurfaceMemory::SurfaceMemory(const SweepLevel& level, const cv::Mat& range_m,
                             const RigidTransform& reference_from_earlier, uint32_t phase)
    : phase_(phase), inverse_range_(pooledMat(range_m.size(), CV_32FC1)) {
  inverse_range_.setTo(kNaN);
  const Eigen::Matrix3f rotation = reference_from_earlier.rotationMatrix().cast<float>();
  const Eigen::Vector3f translation = reference_from_earlier.translation().cast<float>();
  const MeiCamera& camera = level.camera();
  const auto xi = static_cast<float>(camera.xi());
  const auto fx = static_cast<float>(camera.gamma1()), fy = static_cast<float>(camera.gamma2());
  const auto cx = static_cast<float>(camera.u0()), cy = static_cast<float>(camera.v0());
  const RayTable& rays = level.rays();
  const cv::Rect image(cv::Point(), range_m.size());
  size_t at = 0;
  for (int y = 0; y < range_m.rows; ++y) {
    const auto* range = range_m.ptr<float>(y);
    for (int x = 0; x < range_m.cols; ++x, ++at) {
      if (!(range[x] > 0.0F)) {
        continue;
      }
      const Eigen::Vector3f point =
          rotation * (range[x] * Eigen::Vector3f(rays.x()[at], rays.y()[at], rays.z()[at])) + translation;
      const float distance = point.norm(), denominator = point.z() + xi * distance;
      if (!(denominator > 0.1F * distance)) {
        continue;
      }
      const cv::Point pixel(cvRound(fx * point.x() / denominator + cx),
                            cvRound(fy * point.y() / denominator + cy));
      if (image.contains(pixel)) {
        float& inverse = inverse_range_.at<float>(pixel);
        const float now = 1.0F / distance;
        inverse = inverse > now ? inverse : now;  // the nearest; NaN is replaced
      }
    }
  }
}

bool SurfaceMemory::applyToTile(const SurfaceEstimate& coarse, const cv::Rect& tile,
                                SurfaceEstimate* estimate) const {
  const cv::Size half = coarse.score.size();
  int textured = 0, covered = 0, confident = 0, agreeing = 0, jumps = 0;
  const auto confidentAt = [&](int x, int y) {
    return isConfident(coarse.score.at<float>(y, x), coarse.second_score.at<float>(y, x));
  };
  for (int y = tile.y; y < tile.br().y; y += 2) {
    const int half_y = std::min(y / 2, half.height - 1);
    const auto* predicted = inverse_range_.ptr<float>(y);
    for (int x = tile.x; x < tile.br().x; x += 2) {
      const int half_x = std::min(x / 2, half.width - 1);
      if (coarse.plane.at<int>(half_y, half_x) < 0) {
        continue;
      }
      ++textured;
      const float value =
          predicted[x] == predicted[x] ? predicted[x] : predicted[std::min(x + 1, inverse_range_.cols - 1)];
      if (!(value == value)) {  // NaN differs from itself
        continue;
      }
      ++covered;
      const float step = coarse.step.at<float>(half_y, half_x);
      if (confidentAt(half_x, half_y)) {
        ++confident;
        const float off = std::abs(value - coarse.inverse_range.at<float>(half_y, half_x));
        agreeing += off <= kAgreement * step ? 1 : 0;
      }
      const float right = predicted[std::min(x + kJumpReach_px, inverse_range_.cols - 1)];
      const float below = inverse_range_.at<float>(std::min(y + kJumpReach_px, inverse_range_.rows - 1), x);
      jumps += std::abs(right - value) > kJump * step || std::abs(below - value) > kJump * step ? 1 : 0;
    }
  }
  if (covered < kMinCovered * textured || agreeing < kMinAgreeing * confident ||
      jumps > kMaxJumps * covered) {
    return false;
  }
  for (int y = tile.y; y < tile.br().y; ++y) {
    const int half_y = std::min(y / 2, half.height - 1);
    for (int x = tile.x; x < tile.br().x; ++x) {
      const int half_x = std::min(x / 2, half.width - 1);
      const int plane = coarse.plane.at<int>(half_y, half_x);
      if (plane < 0) {
        continue;
      }
      const float step = coarse.step.at<float>(half_y, half_x);
      const float seen = coarse.inverse_range.at<float>(half_y, half_x);
      const float predicted = inverse_range_.at<float>(y, x);
      const bool agrees = std::abs(predicted - seen) <= kAgreement * step;  // false without prediction
      estimate->inverse_range.at<float>(y, x) = agrees || !confidentAt(half_x, half_y) ? predicted : seen;
      estimate->step.at<float>(y, x) = 0.5F * step;
      estimate->score.at<float>(y, x) = kNoCorrelation;
      estimate->second_score.at<float>(y, x) = coarse.second_score.at<float>(half_y, half_x);
      estimate->plane.at<int>(y, x) = plane;
    }
  }
  return true;
}

std::vector<cv::Rect> SurfaceMemory::apply(const SurfaceEstimate& coarse, const std::vector<cv::Rect>& tiles,
                                           SurfaceEstimate* estimate) const {
  std::vector<uint8_t> is_predicted(tiles.size());
  tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t i) {
    is_predicted[i] = (i + phase_) % kPeriod != 0 && applyToTile(coarse, tiles[i], estimate) ? 1 : 0;
  });
  std::vector<cv::Rect> left;
  for (size_t i = 0; i < tiles.size(); ++i) {
    if (is_predicted[i] == 0) {
      left.push_back(tiles[i]);
    }
  }
  return left;
}

}  // namespace vcharge
