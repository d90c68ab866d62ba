#include "parking/paint_lines.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kNumDirections = 24;
constexpr double kWindow_m = 0.8;  // along a line, over which its contrast is averaged
constexpr double kMinLength_m = 0.5;
constexpr double kMinContrast = 0.05;  // paint that is worn more is left to the model of rows
constexpr double kMinSigmas = 4.0;     // contrast over that of the ground's texture
constexpr double kGap_m = 0.3;         // along a line, at most
constexpr double kSameLine_m = 0.2;
constexpr double kSameLine_rad = 0.25;

/// The ground turned so that lines of one direction run down the columns.
class TurnedGround {
 public:
  TurnedGround(const GroundImage& ground, double angle_rad)
      : along_(std::cos(angle_rad), std::sin(angle_rad)), across_(along_.y(), -along_.x()) {
    const cv::Size size = ground.isGround().size();
    const Eigen::Vector2d half(0.5 * (size.width - 1), 0.5 * (size.height - 1));
    const Eigen::Vector2d extent(across_.cwiseAbs().dot(half), along_.cwiseAbs().dot(half));
    const cv::Size turned(2 * static_cast<int>(std::ceil(extent.x())) + 1,
                          2 * static_cast<int>(std::ceil(extent.y())) + 1);
    first_ = half - across_ * (0.5 * (turned.width - 1)) - along_ * (0.5 * (turned.height - 1));
    const cv::Matx23d source_from_turned(across_.x(), along_.x(), first_.x(), across_.y(), along_.y(),
                                         first_.y());
    const int window = 2 * static_cast<int>(std::lround(0.5 * kWindow_m / ground.cellSize_m())) + 1;
    for (auto [source, target] : {std::pair(&ground.brightness(), &sum_), {&ground.isGround(), &weight_}}) {
      cv::warpAffine(*source, *target, source_from_turned, turned, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
      cv::boxFilter(*target, *target, -1, {3, window}, {-1, -1}, true, cv::BORDER_CONSTANT);
    }
  }

  int columns() const { return sum_.cols; }
  int rows() const { return sum_.rows; }
  Eigen::Vector2d cellOf(int column, int row) const { return first_ + column * across_ + row * along_; }

  /// Contrast of each cell to both sides: CV_32FC1, of the smaller one and of their mean; NaN if unknown.
  void contrasts(int beside, cv::Mat* smaller, cv::Mat* mean) const {
    constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
    constexpr float kMinWeight = 0.5F, kUnlit = 1e3F;
    *smaller = cv::Mat(sum_.size(), CV_32FC1, kUnknown);
    *mean = smaller->clone();
    for (int row = 0; row < rows(); ++row) {
      const auto* sum = sum_.ptr<float>(row);
      const auto* weight = weight_.ptr<float>(row);
      for (int column = beside; column + beside < columns(); ++column) {
        const int left = column - beside, right = column + beside;
        const bool has_left = weight[left] > kMinWeight, has_right = weight[right] > kMinWeight;
        if (weight[column] <= kMinWeight || (!has_left && !has_right)) {
          continue;
        }
        const float here = sum[column] / weight[column];
        const float to_left = here - (has_left ? sum[left] / weight[left] : -kUnlit);
        const float to_right = here - (has_right ? sum[right] / weight[right] : -kUnlit);
        smaller->at<float>(row, column) = std::min(to_left, to_right);
        if (has_left && has_right) {
          mean->at<float>(row, column) = 0.5F * (to_left + to_right);
        }
      }
    }
  }

 private:
  Eigen::Vector2d along_, across_, first_;
  cv::Mat sum_, weight_;
};

/// Standard deviation of values around zero, from the median of their sizes.
float deviationOf(const cv::Mat& values) {
  constexpr double kMedianOfNormal = 0.6745;
  std::vector<double> sizes;
  for (int row = 0; row < values.rows; ++row) {
    const auto* value = values.ptr<float>(row);
    std::for_each(value, value + values.cols, [&](float one) {
      if (std::isfinite(one)) {
        sizes.push_back(std::abs(one));
      }
    });
  }
  if (sizes.empty()) {
    return 0.0F;
  }
  return static_cast<float>(quantile(std::move(sizes), 0.5) / kMedianOfNormal);
}

/// A rough line in cells of the ground image.
struct Chain {
  int column, row, first_column, first_row;
};

/// Runs of the brightest columns down the rows.
std::vector<Chain> chainsOf(const cv::Mat& contrast, float least, int reach, int gap) {
  std::vector<Chain> active, ended;
  for (int row = 0; row < contrast.rows; ++row) {
    const auto* value = contrast.ptr<float>(row);
    for (int column = reach; column + reach < contrast.cols; ++column) {
      if (!(value[column] >= least) || std::any_of(value + column - reach, value + column + reach + 1,
                                                   [&](float other) { return other > value[column]; })) {
        continue;
      }
      const auto same = std::find_if(active.begin(), active.end(), [&](const Chain& chain) {
        return std::abs(chain.column - column) <= 1 && chain.row < row;
      });
      if (same != active.end()) {
        same->column = column;
        same->row = row;
      } else {
        active.push_back({column, row, column, row});
      }
    }
    const auto begin = std::partition(active.begin(), active.end(),
                                      [&](const Chain& chain) { return row - chain.row <= gap; });
    ended.insert(ended.end(), begin, active.end());
    active.erase(begin, active.end());
  }
  ended.insert(ended.end(), active.begin(), active.end());
  return ended;
}

/// Lines of one direction, roughly.
std::vector<PaintLine> roughLines(const GroundImage& ground, double angle_rad) {
  const TurnedGround turned(ground, angle_rad);
  const double cell_m = ground.cellSize_m();
  cv::Mat smaller, mean;
  turned.contrasts(static_cast<int>(std::lround(kBesideLine_m / cell_m)), &smaller, &mean);
  const float least =
      std::max(static_cast<float>(kMinContrast), static_cast<float>(kMinSigmas) * deviationOf(mean));
  std::vector<PaintLine> lines;
  for (const Chain& chain : chainsOf(smaller, least, static_cast<int>(std::lround(0.15 / cell_m)),
                                     static_cast<int>(std::lround(kGap_m / cell_m)))) {
    if ((chain.row - chain.first_row) * cell_m >= kMinLength_m) {
      lines.push_back({ground.positionOf(turned.cellOf(chain.first_column, chain.first_row)),
                       ground.positionOf(turned.cellOf(chain.column, chain.row))});
    }
  }
  return lines;
}

/// The middle of the paint across a line at a position, if there is any within reach.
std::optional<double> middleOfPaint(const GroundImage& ground, const Eigen::Vector2d& position_m,
                                    const Eigen::Vector2d& across, double reach_m) {
  constexpr double kStep_m = 0.025;
  std::vector<std::pair<double, double>> profile;
  const int steps = static_cast<int>(std::lround((reach_m + kBesideLine_m) / kStep_m));
  double background = 0.0;
  int count = 0;
  for (int i = -steps; i <= steps; ++i) {
    const double offset_m = i * kStep_m;
    const auto found = ground.at(position_m + offset_m * across);
    if (!found && std::abs(offset_m) <= reach_m) {
      return std::nullopt;
    }
    if (!found) {
      continue;
    }
    profile.emplace_back(offset_m, *found);
    if (std::abs(offset_m) > reach_m) {
      background += *found;
      ++count;
    }
  }
  if (count == 0) {
    return std::nullopt;
  }
  background /= count;
  double weight = 0.0, sum = 0.0;
  for (const auto& [offset_m, value] : profile) {
    if (std::abs(offset_m) <= reach_m && value > background) {
      weight += value - background;
      sum += (value - background) * offset_m;
    }
  }
  return weight > 0.0 ? std::optional(sum / weight) : std::nullopt;
}

/// Moves a line to the middle of its paint by linear regression. False if too little paint is seen.
bool moveToMiddle(const GroundImage& ground, PaintLine* line) {
  constexpr double kReach_m = 0.15;
  const double step_m = ground.cellSize_m(), length_m = line->length_m();
  const Eigen::Vector2d along = line->direction(), across = rightOf(along);
  std::vector<Eigen::Vector2d> middles;  // along and across
  const int steps = static_cast<int>(length_m / step_m);
  for (int i = 0; i <= steps; ++i) {
    if (const auto offset_m = middleOfPaint(ground, line->from_m + i * step_m * along, across, kReach_m)) {
      middles.emplace_back(i * step_m, *offset_m);
    }
  }
  if (middles.size() * step_m < 0.5 * kMinLength_m) {
    return false;
  }
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& middle : middles) {
    mean += middle / static_cast<double>(middles.size());
  }
  double xx = 1e-9, xy = 0.0;
  for (const Eigen::Vector2d& middle : middles) {
    const Eigen::Vector2d d = middle - mean;
    xx += d.x() * d.x();
    xy += d.x() * d.y();
  }
  const double slope = xy / xx;
  const Eigen::Vector2d origin_m = line->from_m;
  line->from_m = origin_m + (mean.y() - slope * mean.x()) * across;
  line->to_m = origin_m + length_m * along + (mean.y() + slope * (length_m - mean.x())) * across;
  return true;
}

/// Takes the contrast of a line, and moves its ends to where it falls below a part of that. False if the line
/// is pale or short.
bool moveToEnds(const GroundImage& ground, PaintLine* line) {
  constexpr double kEndRatio = 0.45, kBeyond_m = 1.5;
  const double step_m = ground.cellSize_m();
  const Eigen::Vector2d along = line->direction(), across = rightOf(along);
  const int inside = static_cast<int>(line->length_m() / step_m),
            beyond = static_cast<int>(kBeyond_m / step_m);
  std::vector<std::optional<LineContrast>> contrasts;
  std::vector<double> known;
  for (int i = -beyond; i <= inside + beyond; ++i) {
    contrasts.push_back(ground.lineContrast(line->from_m + i * step_m * along, across));
    if (i >= 0 && i <= inside && contrasts.back()) {
      known.push_back(contrasts.back()->smaller());
    }
  }
  if (known.size() * step_m < 0.5 * kMinLength_m) {
    return false;
  }
  line->contrast = quantile(known, 0.5);
  if (line->contrast < kMinContrast) {
    return false;
  }
  const auto end = [&](int direction) {
    int last = beyond + inside / 2;
    const int gap = static_cast<int>(kGap_m / step_m);
    for (int i = last; i >= 0 && i < static_cast<int>(contrasts.size()) && std::abs(i - last) <= gap;
         i += direction) {
      const auto& contrast = contrasts[static_cast<size_t>(i)];
      if (contrast && contrast->smaller() >= kEndRatio * line->contrast) {
        last = i;
      }
    }
    return last - beyond;
  };
  const int first = end(-1), last = end(1);
  const Eigen::Vector2d from_m = line->from_m;
  line->from_m = from_m + (first - 0.5) * step_m * along;
  line->to_m = from_m + (last + 0.5) * step_m * along;
  return line->length_m() >= kMinLength_m;
}

/// Fits the middle of a line and its ends to the paint. False if there is no clear line.
bool fit(const GroundImage& ground, PaintLine* line) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    if (!moveToMiddle(ground, line)) {
      return false;
    }
  }
  return moveToEnds(ground, line);
}

/// Whether the middle of a line lies on another of the same direction.
bool isPartOf(const PaintLine& line, const PaintLine& other) {
  const Eigen::Vector2d along = other.direction();
  const Eigen::Vector2d from = 0.5 * (line.from_m + line.to_m) - other.from_m;
  return std::abs(along.dot(line.direction())) >= std::cos(kSameLine_rad) &&
         std::abs(rightOf(along).dot(from)) < kSameLine_m && along.dot(from) > -kSameLine_m &&
         along.dot(from) < other.length_m() + kSameLine_m;
}

}  // namespace

std::vector<PaintLine> findPaintLines(const GroundImage& ground) {
  std::vector<std::vector<PaintLine>> of_direction(kNumDirections);
  tbb::parallel_for(0, kNumDirections, [&](int i) {
    std::vector<PaintLine>& lines = of_direction[static_cast<size_t>(i)];
    for (PaintLine& line : roughLines(ground, i * kPi / kNumDirections)) {
      if (fit(ground, &line)) {
        lines.push_back(line);
      }
    }
  });
  std::vector<PaintLine> all;
  for (const std::vector<PaintLine>& lines : of_direction) {
    all.insert(all.end(), lines.begin(), lines.end());
  }
  std::stable_sort(all.begin(), all.end(), [](const PaintLine& a, const PaintLine& b) {
    return a.length_m() * a.contrast > b.length_m() * b.contrast;
  });
  std::vector<PaintLine> kept;
  for (const PaintLine& line : all) {
    if (std::none_of(kept.begin(), kept.end(),
                     [&](const PaintLine& other) { return isPartOf(line, other); })) {
      kept.push_back(line);
    }
  }
  return kept;
}

}  // namespace vcharge
