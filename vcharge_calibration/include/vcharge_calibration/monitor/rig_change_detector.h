#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "vcharge_calibration/monitor/rig_deviation.h"

namespace vcharge {

/// What changed: one camera, the odometer (a tyre, or its settings), or how the body stands on its wheels (a
/// load), which moves all cameras as one.
enum class RigPart { kCamera, kOdometer, kBody };

/// A change of the car that lasts.
struct RigChange {
  RigPart part = RigPart::kCamera;
  /// It continues an earlier change of the same part in the same direction, not far away: it goes on slowly.
  bool is_slow = false;
  size_t camera = 0;        ///< for kCamera
  double earliest_m = 0.0;  ///< driven distance between which and `latest_m` it happened
  double latest_m = 0.0;
  double found_m = 0.0;  ///< driven distance at which it was certain
  Timestamp found;
  /// Camera: [dt, dphi] in the vehicle's frame. Odometer: factors of distance and turn, and turn per metre.
  /// Body: height, roll, pitch.
  Eigen::VectorXd size;
  Eigen::MatrixXd covariance;
  double log_probability = 0.0;  ///< that chance alone gives such a change, natural logarithm

  /// The component of `size` that is largest relative to its deviation.
  Eigen::Index mainAxis() const;
};

/// Finds when and what changed, from the deviations of successive parts of a drive: generalized likelihood
/// ratio test (Willsky and Jones, IEEE Trans. Automatic Control 21(1), 1976) of each part of the car and each
/// time against no change. All hypotheses are tested at the same rate of false alarms, and a change is
/// believed if it is certain without any single part of the drive, too.
///
/// Each part of a drive adds an error of its own, above all because the body leans.
class RigChangeDetector {
 public:
  /// `false_alarms_per_km`: the rate that is accepted where nothing changes. A camera without covariance is
  /// taken to be known within 1 cm and 0.06 degrees.
  RigChangeDetector(const CameraRig& rig, double false_alarms_per_km);

  /// Adds the next part of the drive; returns a change that it made certain.
  std::optional<RigChange> add(const RigDeviation& deviation);

  /// From now on deviations are counted from a rig that deviates by this from the one before.
  void countFrom(const Eigen::VectorXd& deviation);

  /// The present deviation from the rig and its covariance, in the order of RigDeviation.
  Eigen::VectorXd deviation() const;
  Eigen::MatrixXd covariance() const;

 private:
  /// A Gaussian belief about the deviation in information form.
  struct Belief {
    Eigen::MatrixXd information;
    Eigen::VectorXd vector;
    Belief& operator+=(const Belief& other);
    Belief& operator-=(const Belief& other);
  };
  struct Observation {
    Belief belief;
    double begin_m = 0.0, end_m = 0.0;
  };
  struct Hypothesis {
    RigPart part = RigPart::kCamera;
    size_t camera = 0;
    Eigen::MatrixXd by_size;           ///< derivative of the deviation by the size of the change
    Eigen::MatrixXd size_information;  ///< prior of the size
  };
  struct Test {
    double square = 0.0;  ///< of the size over its deviation: chi-square distributed without a change
    double log_probability = 0.0;
    Eigen::VectorXd size;
    Eigen::MatrixXd covariance;
  };

  Belief withOwnErrors(const RigDeviation& deviation) const;
  /// Tests a change between observations whose sum is `after` and all others, given the sum of all.
  static Test test(const Hypothesis& hypothesis, const Belief& all,
                   const Eigen::LLT<Eigen::MatrixXd>& all_information, const Belief& after);
  /// The observation without which a change at `first` is least certain, and the test without it.
  std::pair<size_t, Test> weakestTest(const Hypothesis& hypothesis, size_t first) const;
  /// Whether a change goes on with one of the earlier ones.
  bool continuesEarlier(const RigChange& change) const;
  void accept(const Hypothesis& hypothesis, size_t first);
  Belief sumOf(size_t begin, size_t end) const;
  Belief present() const;

  const double false_alarms_per_km_;
  std::vector<Hypothesis> hypotheses_;
  Eigen::MatrixXd own_information_;  ///< inverse covariance of the error of a part of a drive
  Belief start_;                     ///< before the observations
  std::vector<Observation> observations_;
  std::vector<RigChange> changes_;
};

}  // namespace vcharge
