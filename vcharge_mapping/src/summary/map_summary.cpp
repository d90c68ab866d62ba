#include "vcharge_mapping/map_summary.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <numeric>
#include <queue>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "update/reduced_map.h"
#include "update/same_place.h"
#include "vcharge_core/base/quantile.h"
#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix36d = Eigen::Matrix<double, 3, 6>;

/// A pose is known that well without any landmark; keeps the information regular.
constexpr double kPriorSigma_m = 1.0;
constexpr double kPriorSigma_rad = 0.2;
// The logarithm of the odds that another drive finds a landmark which one drive saw over an extent e (the
// diagonal of the box around its positions) is kFoundLogOdds + kFoundSlope * log(e + kMinExtent_m), and the
// evidence of more drives is added. Fitted to which landmarks of three simulated lots another day's drive
// found: 3 % of those seen over 1 m, half of those seen over 13 m.
constexpr double kFoundLogOdds = -4.1, kFoundSlope = 1.6, kMinExtent_m = 0.5;
/// Part of the landmarks which a drive finds in passing a place that one of its frames finds. Measured: 0.27
/// to 0.34 with maps of one drive on eight simulated lots, 0.38 to 0.45 with a map of four.
constexpr double kFoundInFrame = 0.3;
/// Deviation of an observed direction.
constexpr double kRaySigma_rad = 0.002;
/// How much the number of landmarks found counts beside the variance: the pose is found without a prior only
/// by many of them, and near ones, which tell most of the position, are few.
constexpr double kNumberWeight = 0.1;

/// A landmark in an image: its part of the information of the keyframe's pose is jacobian^T jacobian.
struct View {
  int32_t keyframe = 0;
  Matrix36d jacobian = Matrix36d::Zero();
  double found = 0.0;  ///< probability that another drive finds it
};

/// For each keyframe, those that show what it observes too: itself, and those of other sessions of which it
/// is the nearest of its session at their place.
std::vector<std::vector<int32_t>> shownAt(const SparseMap& map) {
  const std::vector<MapKeyframe>& keyframes = map.keyframes();
  std::vector<int32_t> by_x(keyframes.size());
  std::iota(by_x.begin(), by_x.end(), 0);
  const auto xOf = [&](int32_t k) { return keyframes[k].map_from_vehicle.translation().x(); };
  std::sort(by_x.begin(), by_x.end(),
            [&](int32_t a, int32_t b) { return std::make_pair(xOf(a), a) < std::make_pair(xOf(b), b); });
  std::vector<std::vector<int32_t>> shown_at(keyframes.size());
  size_t first = 0;
  for (const int32_t k : by_x) {
    while (xOf(by_x[first]) < xOf(k) - kPlaceRadius_m) {
      ++first;
    }
    std::map<int32_t, std::pair<double, int32_t>> nearest;  // by session
    for (size_t i = first; i < by_x.size() && xOf(by_x[i]) <= xOf(k) + kPlaceRadius_m; ++i) {
      const MapKeyframe& other = keyframes[by_x[i]];
      if (other.session != keyframes[k].session && isAtPlace(keyframes[k], other)) {
        const double distance_m =
            (other.map_from_vehicle.translation() - keyframes[k].map_from_vehicle.translation()).norm();
        const std::pair<double, int32_t> found(distance_m, by_x[i]);
        nearest[other.session] = std::min(nearest.try_emplace(other.session, found).first->second, found);
      }
    }
    shown_at[k].push_back(k);
    for (const auto& [session, found] : nearest) {
      shown_at[found.second].push_back(k);
    }
  }
  return shown_at;
}

class LandmarkChooser {
 public:
  LandmarkChooser(const SparseMap& map, const SummaryOptions& options)
      : map_(map),
        options_(options),
        views_(map.landmarks().size()),
        chosen_(map.landmarks().size(), false),
        found_(map.keyframes().size(), 0.0),
        found_of_all_(map.keyframes().size(), 0.0) {
    Matrix6d prior = Matrix6d::Zero();
    prior.diagonal().head<3>().setConstant(1.0 / (kPriorSigma_m * kPriorSigma_m));
    prior.diagonal().tail<3>().setConstant(1.0 / (kPriorSigma_rad * kPriorSigma_rad));
    information_.assign(map.keyframes().size(), prior);
    covariance_.assign(map.keyframes().size(), prior.inverse());
    std::vector<Matrix6d> all = information_;
    const std::vector<std::vector<int32_t>> shown_at = shownAt(map);
    for (size_t l = 0; l < map.landmarks().size(); ++l) {
      const double found = foundProbability(l);
      std::map<int32_t, int32_t> camera_at;  // by keyframe
      const auto [begin, end] = map.observationsOfLandmark(l);
      for (const int32_t* i = begin; i != end; ++i) {
        const MapObservation& observation = map.observations()[*i];
        for (const int32_t keyframe : shown_at[observation.keyframe]) {
          camera_at.emplace(keyframe, observation.camera);
        }
      }
      for (const auto& [keyframe, camera] : camera_at) {
        views_[l].push_back(viewOf(l, keyframe, camera, found));
        const View& view = views_[l].back();
        all[keyframe] += view.jacobian.transpose() * view.jacobian;
        found_of_all_[keyframe] += view.found;
      }
    }
    for (const Matrix6d& information : all) {
      sigma_of_all_m_.push_back(positionSigma_m(information.inverse()));
    }
  }

  std::vector<bool> choose() {
    const auto max_chosen = static_cast<size_t>(
        std::ceil(options_.max_landmark_ratio * static_cast<double>(map_.landmarks().size())));
    std::vector<double> gains(views_.size());
    tbb::parallel_for(size_t{0}, views_.size(), [&](size_t l) { gains[l] = gainOf(l); });
    // Gains seldom grow while others are chosen: the best one is known without computing all of them.
    std::priority_queue<std::pair<double, int32_t>> queue;
    for (size_t l = 0; l < gains.size(); ++l) {
      queue.emplace(gains[l], -static_cast<int32_t>(l));
    }
    size_t num_chosen = 0;
    while (!queue.empty() && num_chosen < max_chosen) {
      const auto landmark = static_cast<size_t>(-queue.top().second);
      queue.pop();
      const double gain = gainOf(landmark);
      if (!queue.empty() && gain < queue.top().first) {
        if (gain > 0.0) {
          queue.emplace(gain, -static_cast<int32_t>(landmark));
        }
        continue;
      }
      if (gain <= 0.0) {
        continue;  // it is in view only where there are enough
      }
      add(landmark);
      ++num_chosen;
    }
    return chosen_;
  }

  SummaryReport report() const {
    SummaryReport report;
    report.num_landmarks_before = chosen_.size();
    report.num_landmarks = static_cast<size_t>(std::count(chosen_.begin(), chosen_.end(), true));
    if (covariance_.empty()) {
      return report;
    }
    std::vector<double> factors;
    for (size_t k = 0; k < covariance_.size(); ++k) {
      factors.push_back(positionSigma_m(covariance_[k]) / sigma_of_all_m_[k]);
    }
    report.worst_sigma_factor = *std::max_element(factors.begin(), factors.end());
    report.median_sigma_factor = quantile(factors, 0.5);
    report.mean_sigma_factor = geometricMeanOf(factors);
    report.least_sigma_factor = report.mean_sigma_factor * std::exp(-possibleGain(report.num_landmarks));
    report.median_num_found_before = kFoundInFrame * quantile(found_of_all_, 0.5);
    report.median_num_found = kFoundInFrame * quantile(found_, 0.5);
    return report;
  }

 private:
  static double geometricMeanOf(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) {
      sum += std::log(value);
    }
    return std::exp(sum / static_cast<double>(values.size()));
  }

  static double positionSigma_m(const Matrix6d& covariance) {
    return std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  }

  /// Probability that another drive finds a landmark.
  double foundProbability(size_t landmark) const {
    Eigen::AlignedBox3d seen_from;
    const auto [begin, end] = map_.observationsOfLandmark(landmark);
    for (const int32_t* i = begin; i != end; ++i) {
      seen_from.extend(map_.keyframes()[map_.observations()[*i].keyframe].map_from_vehicle.translation());
    }
    const double extent_m = begin == end ? 0.0 : seen_from.diagonal().norm();
    const double log_odds = kFoundLogOdds + kFoundSlope * std::log(extent_m + kMinExtent_m) +
                            map_.landmarks()[landmark].presence_log_odds;
    return 1.0 / (1.0 + std::exp(-log_odds));
  }

  View viewOf(size_t of_landmark, int32_t keyframe, int32_t camera, double found) const {
    const MapLandmark& landmark = map_.landmarks()[of_landmark];
    const Eigen::Vector3d in_vehicle =
        map_.keyframes()[keyframe].map_from_vehicle.inverse() * landmark.position_m;
    const Eigen::Vector3d from_camera =
        in_vehicle - map_.rig().cameras[camera].vehicle_from_camera->translation();
    const double range_m = from_camera.norm();
    const Eigen::Vector3d ray = from_camera / range_m;
    // Direction of the point under a small motion of the vehicle, [dt, dphi] in its own frame.
    Matrix36d motion;
    motion << -Eigen::Matrix3d::Identity(), crossMatrix(in_vehicle);
    const double variance_rad2 =
        kRaySigma_rad * kRaySigma_rad + landmark.covariance_m2.trace() / 3.0 / (range_m * range_m);
    View view;
    view.keyframe = keyframe;
    view.found = found;
    view.jacobian = std::sqrt(view.found / variance_rad2) / range_m *
                    (Eigen::Matrix3d::Identity() - ray * ray.transpose()) * motion;
    return view;
  }

  bool hasEnough(int32_t keyframe) const {
    const double least = std::min(options_.min_found_per_frame / kFoundInFrame, found_of_all_[keyframe]);
    return found_[keyframe] >= least &&
           positionSigma_m(covariance_[keyframe]) <= options_.max_sigma_factor * sigma_of_all_m_[keyframe];
  }

  /// How much the logarithms of the positions' variances shrink, and those of the numbers of landmarks found
  /// grow, where there are not enough landmarks yet.
  double gainOf(size_t landmark) const {
    double gain = 0.0;
    for (const View& view : views_[landmark]) {
      if (!hasEnough(view.keyframe)) {
        // The covariance without and with the landmark (Woodbury's identity).
        const Matrix6d& covariance = covariance_[view.keyframe];
        const Eigen::Matrix<double, 6, 3> cross = covariance * view.jacobian.transpose();
        const Eigen::Matrix3d innovation = Eigen::Matrix3d::Identity() + view.jacobian * cross;
        const double variance_m2 = covariance.topLeftCorner<3, 3>().trace();
        const double shrunk_m2 =
            (cross.topRows<3>() * innovation.inverse() * cross.topRows<3>().transpose()).trace();
        gain += std::log(variance_m2 / (variance_m2 - shrunk_m2)) +
                kNumberWeight * std::log1p(view.found / (1.0 + found_[view.keyframe]));
      }
    }
    return gain;
  }

  /// By how much, at most, another choice of as many landmarks has a smaller mean logarithm of the
  /// deviations. That is a convex function of the landmarks' weights between 0 and 1 (the inverse of the
  /// trace of a covariance is concave in the information: Pukelsheim, Optimal Design of Experiments, ch. 6):
  /// nowhere does it lie below its tangent at this choice.
  double possibleGain(size_t num_chosen) const {
    std::vector<double> slopes(views_.size());
    tbb::parallel_for(size_t{0}, views_.size(), [&](size_t l) {
      for (const View& view : views_[l]) {
        const Matrix6d& covariance = covariance_[view.keyframe];
        slopes[l] += 0.5 * (view.jacobian * covariance.leftCols<3>()).squaredNorm() /
                     covariance.topLeftCorner<3, 3>().trace();
      }
    });
    double gain = 0.0;
    for (size_t l = 0; l < slopes.size(); ++l) {
      gain -= chosen_[l] ? slopes[l] : 0.0;
    }
    std::partial_sort(slopes.begin(), slopes.begin() + static_cast<std::ptrdiff_t>(num_chosen), slopes.end(),
                      std::greater<>());
    gain = std::accumulate(slopes.begin(), slopes.begin() + static_cast<std::ptrdiff_t>(num_chosen), gain);
    return std::max(gain, 0.0) / static_cast<double>(covariance_.size());
  }

  void add(size_t landmark) {
    chosen_[landmark] = true;
    for (const View& view : views_[landmark]) {
      information_[view.keyframe] += view.jacobian.transpose() * view.jacobian;
      covariance_[view.keyframe] = information_[view.keyframe].inverse();
      found_[view.keyframe] += view.found;
    }
  }

  const SparseMap& map_;
  const SummaryOptions& options_;
  std::vector<std::vector<View>> views_;
  std::vector<bool> chosen_;
  std::vector<double> found_, found_of_all_;  // expected numbers of landmarks that another drive finds
  std::vector<Matrix6d> information_, covariance_;
  std::vector<double> sigma_of_all_m_;
};

}  // namespace

SummaryMap summarizeMap(const SparseMap& map, const SummaryOptions& options) {
  options.validate();
  LandmarkChooser chooser(map, options);
  const std::vector<bool> chosen = chooser.choose();
  SummaryMap summary;
  summary.map = reducedMap(map, std::vector<bool>(map.keyframes().size(), true), chosen);
  summary.report = chooser.report();
  return summary;
}

}  // namespace vcharge
