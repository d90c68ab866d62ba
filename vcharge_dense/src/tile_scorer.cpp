#include "tile_scorer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vectorized.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Below this sum of squares about the mean a window counts as constant.
constexpr float kMinSquares = 1e-3f;

struct ProjectionConstants {
  float fx, fy, cx, cy, xi;
  float max_x, max_y;
};

/// Position in the framed image of each point rotated_ray + inverse_range * translation; the NaN frame at (0,
/// 0) for points without an image (paper, Camera Model; valid while cos(angle to the axis) > -1/xi or > -xi).
VCHARGE_VECTORIZED void projectRow(const ProjectionConstants& camera, const float* rx, const float* ry,
                                   const float* rz, const float* inverse_range, float tx, float ty, float tz,
                                   int count, float* u, float* v) {
  const float min_cosine = camera.xi > 1.0f ? -1.0f / camera.xi : -camera.xi;
  for (int i = 0; i < count; ++i) {
    const float qx = rx[i] + inverse_range[i] * tx;
    const float qy = ry[i] + inverse_range[i] * ty;
    const float qz = rz[i] + inverse_range[i] * tz;
    const float norm = std::sqrt(qx * qx + qy * qy + qz * qz);
    const float inverse = 1.0f / (qz + camera.xi * norm);
    const float x = camera.fx * qx * inverse + camera.cx;
    const float y = camera.fy * qy * inverse + camera.cy;
    const bool seen =
        (qz > min_cosine * norm) & (x >= 0.0f) & (x <= camera.max_x) & (y >= 0.0f) & (y <= camera.max_y);
    u[i] = seen ? x + 1.0f : 0.0f;
    v[i] = seen ? y + 1.0f : 0.0f;
  }
}

/// Bilinear samples of an image of the given stride.
VCHARGE_VECTORIZED void sampleRow(const float* image, int stride, const float* u, const float* v, int count,
                                  float* samples) {
  for (int i = 0; i < count; ++i) {
    const int x = static_cast<int>(u[i]);
    const int y = static_cast<int>(v[i]);
    const float fx = u[i] - static_cast<float>(x);
    const float fy = v[i] - static_cast<float>(y);
    const int at = y * stride + x;
    const float top = image[at] + fx * (image[at + 1] - image[at]);
    const float bottom = image[at + stride] + fx * (image[at + stride + 1] - image[at + stride]);
    samples[i] = top + fy * (bottom - top);
  }
}

/// Sums over `window` neighbouring columns of b, b^2 and a b.
VCHARGE_VECTORIZED void sumColumns(const float* a, const float* b, int window, int count, float* sum_b,
                                   float* sum_bb, float* sum_ab) {
  for (int i = 0; i < count; ++i) {
    sum_b[i] = b[i];
    sum_bb[i] = b[i] * b[i];
    sum_ab[i] = a[i] * b[i];
  }
  for (int k = 1; k < window; ++k) {
    for (int i = 0; i < count; ++i) {
      sum_b[i] += b[i + k];
      sum_bb[i] += b[i + k] * b[i + k];
      sum_ab[i] += a[i + k] * b[i + k];
    }
  }
}

/// Sums over `window` rows of `stride` floats.
VCHARGE_VECTORIZED void sumRows(const float* rows, int stride, int window, int count, float* sum) {
  for (int i = 0; i < count; ++i) {
    sum[i] = rows[i];
  }
  for (int k = 1; k < window; ++k) {
    for (int i = 0; i < count; ++i) {
      sum[i] += rows[k * stride + i];
    }
  }
}

/// Zero-mean normalized cross correlation from the windows' sums; NaN where a window is constant or not all
/// seen.
VCHARGE_VECTORIZED void correlationRow(const float* sum_a, const float* inverse_deviation_a,
                                       const float* sum_b, const float* sum_bb, const float* sum_ab,
                                       float inverse_count, int count, float* score) {
  for (int i = 0; i < count; ++i) {
    const float squares_b = sum_bb[i] - sum_b[i] * sum_b[i] * inverse_count;
    const float covariance = sum_ab[i] - sum_a[i] * sum_b[i] * inverse_count;
    const float correlation = covariance * inverse_deviation_a[i] / std::sqrt(squares_b);
    score[i] = squares_b > kMinSquares ? std::min(correlation, 1.0f) : kNaN;
  }
}

/// Adds scores that are not NaN.
VCHARGE_VECTORIZED void addVotes(const float* scores, uint32_t bit, size_t count, float* sum, float* votes,
                                 uint32_t* voters) {
  for (size_t i = 0; i < count; ++i) {
    const bool vote = scores[i] == scores[i];
    sum[i] += vote ? scores[i] : 0.0f;
    votes[i] += vote ? 1.0f : 0.0f;
    voters[i] |= vote ? bit : 0u;
  }
}

VCHARGE_VECTORIZED void divideVotes(const float* sum, const float* votes, size_t count, float* mean) {
  for (size_t i = 0; i < count; ++i) {
    mean[i] = votes[i] > 0.0f ? sum[i] / votes[i] : kNaN;
  }
}

VCHARGE_VECTORIZED void scaleAndAdd(const float* base, const float* weight, float offset, size_t count,
                                    float* sum) {
  for (size_t i = 0; i < count; ++i) {
    sum[i] = base[i] + offset * weight[i];
  }
}

/// Keeps per pixel the hypothesis with the highest score so far.
VCHARGE_VECTORIZED void keepBest(const float* scores, const uint32_t* voters, int hypothesis, size_t count,
                                 float* best_score, int* best, uint32_t* best_voters) {
  for (size_t i = 0; i < count; ++i) {
    const bool better = scores[i] > best_score[i];
    best_score[i] = better ? scores[i] : best_score[i];
    best[i] = better ? hypothesis : best[i];
    best_voters[i] = better ? voters[i] : best_voters[i];
  }
}

/// Mean over the votes of the neighbours that `selects` names; NaN where none votes.
template <class Selects>
void averageVotes(const SweepInput& input, const Selects& selects,
                  const std::vector<std::vector<float>>& scores, float* mean, std::vector<float>* votes,
                  std::vector<uint32_t>* voters) {
  const size_t count = votes->size();
  std::fill(mean, mean + count, 0.0f);
  std::fill(votes->begin(), votes->end(), 0.0f);
  std::fill(voters->begin(), voters->end(), 0u);
  for (size_t n = 0; n < scores.size(); ++n) {
    if (selects(input.neighbours[n])) {
      addVotes(scores[n].data(), 1u << n, count, mean, votes->data(), voters->data());
    }
  }
  divideVotes(mean, votes->data(), count, mean);
}

/// Mean of the `k` best votes, or of all where there are fewer.
void averageBest(int k, const std::vector<std::vector<float>>& scores, size_t count, float* mean,
                 std::vector<uint32_t>* voters) {
  for (size_t i = 0; i < count; ++i) {
    uint32_t chosen = 0;
    float sum = 0.0f;
    int votes = 0;
    for (; votes < k; ++votes) {
      int best = -1;
      for (size_t n = 0; n < scores.size(); ++n) {
        const bool open = (chosen & (1u << n)) == 0 && !std::isnan(scores[n][i]);
        if (open && (best < 0 || scores[n][i] > scores[static_cast<size_t>(best)][i])) {
          best = static_cast<int>(n);
        }
      }
      if (best < 0) {
        break;
      }
      chosen |= 1u << best;
      sum += scores[static_cast<size_t>(best)][i];
    }
    mean[i] = votes > 0 ? sum / static_cast<float>(votes) : kNaN;
    (*voters)[i] = chosen;
  }
}

}  // namespace

TileScorer::TileScorer(const SweepInput& input, cv::Rect tile)
    : input_(input),
      tile_(tile),
      radius_(input.options->window_px / 2),
      halo_width_(tile.width + 2 * radius_),
      halo_height_(tile.height + 2 * radius_) {
  const auto halo_size = static_cast<size_t>(halo_width_) * static_cast<size_t>(halo_height_);
  reference_.assign(halo_size, kNaN);
  rotated_rays_.assign(input.neighbours.size(), std::vector<float>(3 * halo_size, 0.0f));
  inverse_range_.resize(halo_size);
  warped_.resize(halo_size);
  row_sums_.resize(3 * static_cast<size_t>(tile.width) * static_cast<size_t>(halo_height_));
  position_x_.resize(static_cast<size_t>(halo_width_));
  position_y_.resize(static_cast<size_t>(halo_width_));
  window_sums_.resize(3 * static_cast<size_t>(tile.width));
  const auto tile_size = static_cast<size_t>(tile.area());
  votes_.resize(tile_size);
  other_side_.resize(tile_size);
  voters_.resize(tile_size);
  other_voters_.resize(tile_size);
  neighbour_scores_.assign(input.neighbours.size(), std::vector<float>(static_cast<size_t>(tile.area())));

  const cv::Size size = input.reference.size();
  const RayTable& rays = *input.rays;
  for (int row = 0; row < halo_height_; ++row) {
    const int y = tile.y + row - radius_;
    for (int column = 0; column < halo_width_; ++column) {
      const int x = tile.x + column - radius_;
      if (x < 0 || y < 0 || x >= size.width || y >= size.height) {
        continue;  // stays NaN
      }
      const size_t at =
          static_cast<size_t>(row) * static_cast<size_t>(halo_width_) + static_cast<size_t>(column);
      reference_[at] = input.reference.at<float>(y, x);
      const Eigen::Vector3f ray = rays.ray(x, y);
      for (size_t n = 0; n < input.neighbours.size(); ++n) {
        const Eigen::Vector3f rotated = input.neighbours[n].neighbour_from_reference * ray;
        for (size_t axis = 0; axis < 3; ++axis) {
          rotated_rays_[n][axis * halo_size + at] = rotated[static_cast<int>(axis)];
        }
      }
    }
  }

  // Statistics of the reference's windows; NaN, which no score survives, where a pixel is invalid or texture
  // is missing.
  const int window = 2 * radius_ + 1;
  const double count = window * window;
  const double min_squares = std::max(static_cast<double>(kMinSquares),
                                      count * input.options->min_texture * input.options->min_texture);
  reference_sum_.resize(static_cast<size_t>(tile.area()));
  reference_inverse_deviation_.resize(static_cast<size_t>(tile.area()));
  for (int row = 0; row < tile.height; ++row) {
    for (int column = 0; column < tile.width; ++column) {
      double sum = 0.0, squares = 0.0;
      for (int dy = 0; dy < window; ++dy) {
        const float* pixels = reference_.data() + static_cast<ptrdiff_t>(row + dy) * halo_width_ + column;
        for (int dx = 0; dx < window; ++dx) {
          sum += pixels[dx];
          squares += static_cast<double>(pixels[dx]) * pixels[dx];
        }
      }
      squares -= sum * sum / count;
      const size_t at = static_cast<size_t>(row * tile.width + column);
      reference_sum_[at] = static_cast<float>(sum);
      reference_inverse_deviation_[at] =
          squares >= min_squares ? static_cast<float>(1.0 / std::sqrt(squares)) : kNaN;
    }
  }
}

void TileScorer::warp(const SweepNeighbour& neighbour, const std::vector<float>& rotated_rays) {
  const cv::Size size = input_.reference.size();
  const ProjectionConstants camera{
      static_cast<float>(input_.camera.gamma1()), static_cast<float>(input_.camera.gamma2()),
      static_cast<float>(input_.camera.u0()),     static_cast<float>(input_.camera.v0()),
      static_cast<float>(input_.camera.xi()),     static_cast<float>(size.width - 1),
      static_cast<float>(size.height - 1)};
  const size_t halo_size = reference_.size();
  std::vector<float>& u = position_x_;
  std::vector<float>& v = position_y_;
  const Eigen::Vector3f& t = neighbour.translation_m;
  for (int row = 0; row < halo_height_; ++row) {
    const size_t at = static_cast<size_t>(row) * static_cast<size_t>(halo_width_);
    const float* rays = rotated_rays.data() + at;
    projectRow(camera, rays, rays + halo_size, rays + 2 * halo_size, inverse_range_.data() + at, t.x(), t.y(),
               t.z(), halo_width_, u.data(), v.data());
    sampleRow(neighbour.framed_pixels.data(), size.width + 2, u.data(), v.data(), halo_width_,
              warped_.data() + at);
  }
}

void TileScorer::correlate(float* scores) {
  const int window = 2 * radius_ + 1;
  const size_t plane = static_cast<size_t>(tile_.width) * static_cast<size_t>(halo_height_);
  for (int row = 0; row < halo_height_; ++row) {
    const size_t from = static_cast<size_t>(row) * static_cast<size_t>(halo_width_);
    float* to = row_sums_.data() + static_cast<ptrdiff_t>(row) * tile_.width;
    sumColumns(reference_.data() + from, warped_.data() + from, window, tile_.width, to, to + plane,
               to + 2 * plane);
  }
  std::vector<float>& sums = window_sums_;
  const auto width = static_cast<size_t>(tile_.width);
  for (int row = 0; row < tile_.height; ++row) {
    const float* from = row_sums_.data() + static_cast<ptrdiff_t>(row) * tile_.width;
    for (size_t quantity = 0; quantity < 3; ++quantity) {
      sumRows(from + quantity * plane, tile_.width, window, tile_.width, sums.data() + quantity * width);
    }
    const size_t at = static_cast<size_t>(row) * width;
    correlationRow(reference_sum_.data() + at, reference_inverse_deviation_.data() + at, sums.data(),
                   sums.data() + width, sums.data() + 2 * width, 1.0f / static_cast<float>(window * window),
                   tile_.width, scores + at);
  }
}

void TileScorer::aggregate(float* aggregated) {
  const size_t count = static_cast<size_t>(tile_.area());
  switch (input_.options->aggregation) {
    case Aggregation::kMean:
      averageVotes(
          input_, [](const SweepNeighbour&) { return true; }, neighbour_scores_, aggregated, &votes_,
          &voters_);
      break;
    case Aggregation::kReferenceSplit: {
      // Mean over one side in `aggregated`, over the other in `other`; the better one stays.
      averageVotes(
          input_, [](const SweepNeighbour& n) { return !n.after; }, neighbour_scores_, aggregated, &votes_,
          &voters_);
      averageVotes(
          input_, [](const SweepNeighbour& n) { return n.after; }, neighbour_scores_, other_side_.data(),
          &votes_, &other_voters_);
      for (size_t i = 0; i < count; ++i) {
        if (!(aggregated[i] >= other_side_[i]) && !std::isnan(other_side_[i])) {
          aggregated[i] = other_side_[i];
          voters_[i] = other_voters_[i];
        }
      }
      break;
    }
    case Aggregation::kBestK:
      averageBest(input_.options->best_k, neighbour_scores_, count, aggregated, &voters_);
      break;
  }
}

void TileScorer::score(const Hypotheses& hypotheses, TileScores* result) {
  const size_t count = static_cast<size_t>(tile_.area());
  result->tile = tile_;
  result->scores.resize(count * hypotheses.offsets.size());
  result->best.assign(count, -1);
  result->voters.assign(count, 0);
  std::vector<float> best_score(count, -std::numeric_limits<float>::infinity());

  // Base and weight with the halo, NaN outside the image.
  std::vector<float> base(reference_.size(), kNaN), weight(reference_.size(), kNaN);
  const cv::Rect image(cv::Point(), input_.reference.size());
  const cv::Rect halo(tile_.x - radius_, tile_.y - radius_, halo_width_, halo_height_);
  const cv::Rect inside = halo & image;
  cv::Mat base_view(halo_height_, halo_width_, CV_32FC1, base.data());
  cv::Mat weight_view(halo_height_, halo_width_, CV_32FC1, weight.data());
  hypotheses.base(inside).copyTo(base_view(inside - halo.tl()));
  hypotheses.weight(inside).copyTo(weight_view(inside - halo.tl()));

  for (size_t k = 0; k < hypotheses.offsets.size(); ++k) {
    scaleAndAdd(base.data(), weight.data(), hypotheses.offsets[k], base.size(), inverse_range_.data());
    for (size_t n = 0; n < input_.neighbours.size(); ++n) {
      warp(input_.neighbours[n], rotated_rays_[n]);
      correlate(neighbour_scores_[n].data());
    }
    float* aggregated = result->scores.data() + k * count;
    aggregate(aggregated);
    keepBest(aggregated, voters_.data(), static_cast<int>(k), count, best_score.data(), result->best.data(),
             result->voters.data());
  }
}

}  // namespace vcharge
