#include "sweep/surface_memory.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>
#include <Eigen/Core>

#include "exposure/row_times.h"
#include "kernels/pooled_mat.h"
#include "sweep/coarse_pass.h"
#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Every tile is swept in full once in this number of sweeps.
constexpr uint32_t kPeriod = 6;
// The prediction and the coarse pass agree within this number of its planes.
constexpr float kAgreement = 1.5F;
// A prediction tells much if it covers this fraction of the valid pixels.
constexpr double kMuch = 0.3;
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

bool isKnown(float value) {
  return value == value;  // NaN differs from itself
}

/// A row of an earlier range map as the reference sees it.
struct MovedRow {
  std::vector<float> x, y, z;  // points in the reference's frame
  std::vector<float> u, v;
  std::vector<float> time_s;         // of exposure, after the stamp
  std::vector<float> inverse_range;  // not positive where a range is unknown or the point invisible

  explicit MovedRow(size_t columns)
      : x(columns), y(columns), z(columns), u(columns), v(columns), time_s(columns), inverse_range(columns) {}
};

VCHARGE_WIDE_LOOPS void moveRow(const SweepLevel& level, const cv::Mat& range_m, int y,
                                const RigidTransform& reference_from_earlier, MovedRow* row) {
  const Eigen::Matrix3f r = reference_from_earlier.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = reference_from_earlier.translation().cast<float>();
  const float r00 = r(0, 0), r01 = r(0, 1), r02 = r(0, 2), r10 = r(1, 0), r11 = r(1, 1), r12 = r(1, 2);
  const float r20 = r(2, 0), r21 = r(2, 1), r22 = r(2, 2), tx = t.x(), ty = t.y(), tz = t.z();
  const size_t columns = row->u.size(), first = static_cast<size_t>(y) * columns;
  const auto* range = range_m.ptr<float>(y);
  const float* ray_x = level.rays().x().data() + first;
  const float* ray_y = level.rays().y().data() + first;
  const float* ray_z = level.rays().z().data() + first;
  float* x = row->x.data();
  float* y_down = row->y.data();
  float* z = row->z.data();
  for (size_t i = 0; i < columns; ++i) {
    x[i] = range[i] * (r00 * ray_x[i] + r01 * ray_y[i] + r02 * ray_z[i]) + tx;
    y_down[i] = range[i] * (r10 * ray_x[i] + r11 * ray_y[i] + r12 * ray_z[i]) + ty;
    z[i] = range[i] * (r20 * ray_x[i] + r21 * ray_y[i] + r22 * ray_z[i]) + tz;
  }
}

VCHARGE_WIDE_LOOPS void projectRow(const MeiCamera& camera, MovedRow* row) {
  const auto xi = static_cast<float>(camera.xi());
  const auto fx = static_cast<float>(camera.gamma1()), fy = static_cast<float>(camera.gamma2());
  const auto cx = static_cast<float>(camera.u0()), cy = static_cast<float>(camera.v0());
  const float* x = row->x.data();
  const float* y = row->y.data();
  const float* z = row->z.data();
  float* u = row->u.data();
  float* v = row->v.data();
  float* inverse_range = row->inverse_range.data();
  for (size_t i = 0; i < row->x.size(); ++i) {
    const float distance = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    const float denominator = z[i] + xi * distance;
    u[i] = fx * x[i] / denominator + cx;
    v[i] = fy * y[i] / denominator + cy;
    inverse_range[i] = denominator > 0.1F * distance ? 1.0F / distance : 0.0F;
  }
}

/// Moves points to where they are in the reference's frame at these times.
VCHARGE_WIDE_LOOPS void exposeRow(const Exposure& exposure, MovedRow* row) {
  const Eigen::Vector3f velocity = exposure.velocity_m_per_s.cast<float>();
  const Eigen::Vector3f turn = exposure.turn_rate_rad_per_s.cast<float>();
  const float vx = velocity.x(), vy = velocity.y(), vz = velocity.z();
  const float wx = turn.x(), wy = turn.y(), wz = turn.z();
  float *x = row->x.data(), *y = row->y.data(), *z = row->z.data();
  const float* time_s = row->time_s.data();
  for (size_t i = 0; i < row->x.size(); ++i) {
    const float px = x[i], py = y[i], pz = z[i];
    x[i] = px - time_s[i] * (wy * pz - wz * py + vx);
    y[i] = py - time_s[i] * (wz * px - wx * pz + vy);
    z[i] = pz - time_s[i] * (wx * py - wy * px + vz);
  }
}

/// A row of the coarse estimate.
struct CoarseRow {
  const float *inverse_range, *step, *score, *second_score;
  const int* plane;

  CoarseRow(const SurfaceEstimate& coarse, int y)
      : inverse_range(coarse.inverse_range.ptr<float>(y)),
        step(coarse.step.ptr<float>(y)),
        score(coarse.score.ptr<float>(y)),
        second_score(coarse.second_score.ptr<float>(y)),
        plane(coarse.plane.ptr<int>(y)) {}
  bool isConfidentAt(int x) const { return isConfident(score[x], second_score[x]); }
};

}  // namespace

SurfaceMemory::SurfaceMemory(const SweepLevel& level, const cv::Mat& range_m,
                             const RigidTransform& reference_from_earlier, const Exposure& exposure,
                             uint32_t phase)
    : phase_(phase), inverse_range_(pooledMat(range_m.size(), CV_32FC1)) {
  inverse_range_.setTo(kNaN);
  const cv::Rect image(cv::Point(), range_m.size());
  MovedRow row(static_cast<size_t>(range_m.cols));
  for (int y = 0; y < range_m.rows; ++y) {
    moveRow(level, range_m, y, reference_from_earlier, &row);
    projectRow(level.camera(), &row);
    if (exposure.moves()) {
      exposureTimesOfRow(level.camera(), exposure.times, row.u.data(), row.v.data(), row.u.size(),
                         row.time_s.data());
      exposeRow(exposure, &row);
      projectRow(level.camera(), &row);
    }
    for (size_t i = 0; i < row.u.size(); ++i) {
      if (row.inverse_range[i] > 0.0F) {
        const cv::Point pixel(cvRound(row.u[i]), cvRound(row.v[i]));
        if (image.contains(pixel)) {
          float& nearest = inverse_range_.at<float>(pixel);
          nearest = nearest > row.inverse_range[i] ? nearest : row.inverse_range[i];  // NaN is replaced
        }
      }
    }
  }
  predicts_much_ =
      cv::countNonZero(inverse_range_ > 0.0F) > kMuch * cv::countNonZero(level.validMask());  // false for NaN
}

bool SurfaceMemory::isBelieved(const SurfaceEstimate& coarse, const cv::Rect& tile) const {
  const cv::Size half = coarse.score.size();
  const int last_column = inverse_range_.cols - 1, last_row = inverse_range_.rows - 1;
  int textured = 0, covered = 0, confident = 0, agreeing = 0, jumps = 0;
  for (int y = tile.y; y < tile.br().y; y += 2) {
    const CoarseRow seen(coarse, std::min(y / 2, half.height - 1));
    const auto* predicted = inverse_range_.ptr<float>(y);
    const auto* predicted_below = inverse_range_.ptr<float>(std::min(y + kJumpReach_px, last_row));
    for (int x = tile.x; x < tile.br().x; x += 2) {
      const int at = std::min(x / 2, half.width - 1);
      if (seen.plane[at] < 0) {
        continue;
      }
      ++textured;
      const float value = isKnown(predicted[x]) ? predicted[x] : predicted[std::min(x + 1, last_column)];
      if (!isKnown(value)) {
        continue;
      }
      ++covered;
      const float step = seen.step[at];
      if (seen.isConfidentAt(at)) {
        ++confident;
        agreeing += std::abs(value - seen.inverse_range[at]) <= kAgreement * step ? 1 : 0;
      }
      const float right = predicted[std::min(x + kJumpReach_px, last_column)];
      const float jump = kJump * step;
      jumps += std::abs(right - value) > jump || std::abs(predicted_below[x] - value) > jump ? 1 : 0;
    }
  }
  return covered >= kMinCovered * textured && agreeing >= kMinAgreeing * confident &&
         jumps <= kMaxJumps * covered;
}

void SurfaceMemory::setTile(const SurfaceEstimate& coarse, const cv::Rect& tile,
                            SurfaceEstimate* estimate) const {
  const cv::Size half = coarse.score.size();
  for (int y = tile.y; y < tile.br().y; ++y) {
    const CoarseRow seen(coarse, std::min(y / 2, half.height - 1));
    const auto* predicted = inverse_range_.ptr<float>(y);
    auto* inverse_range = estimate->inverse_range.ptr<float>(y);
    auto* step = estimate->step.ptr<float>(y);
    auto* score = estimate->score.ptr<float>(y);
    auto* second_score = estimate->second_score.ptr<float>(y);
    auto* plane = estimate->plane.ptr<int>(y);
    for (int x = tile.x; x < tile.br().x; ++x) {
      const int at = std::min(x / 2, half.width - 1);
      if (seen.plane[at] < 0) {
        continue;
      }
      // False without a prediction.
      const bool agrees = std::abs(predicted[x] - seen.inverse_range[at]) <= kAgreement * seen.step[at];
      inverse_range[x] = agrees || !seen.isConfidentAt(at) ? predicted[x] : seen.inverse_range[at];
      step[x] = 0.5F * seen.step[at];
      score[x] = kNoCorrelation;
      second_score[x] = seen.second_score[at];
      plane[x] = seen.plane[at];
    }
  }
}

std::vector<cv::Rect> SurfaceMemory::apply(const SurfaceEstimate& coarse, const std::vector<cv::Rect>& tiles,
                                           SurfaceEstimate* estimate) const {
  std::vector<uint8_t> is_predicted(tiles.size());
  tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t i) {
    if ((i + phase_) % kPeriod != 0 && isBelieved(coarse, tiles[i])) {
      setTile(coarse, tiles[i], estimate);
      is_predicted[i] = 1;
    }
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
