#include "vcharge_reconstruction/bundle_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "adjustment/bundle_equations.h"
#include "adjustment/bundle_errors.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Trust region of Levenberg-Marquardt, with the default values of Ceres.
constexpr double kFirstRadius = 1e4;
constexpr double kMaxRadius = 1e16;
constexpr double kMinRadius = 1e-32;
constexpr double kMinGain = 1e-3;

void checkProblem(const BundleProblem& problem) {
  check(problem.first_observation.size() == problem.points_in_map.size() + 1 &&
            problem.first_observation.back() == problem.observations.size(),
        "BundleProblem: expected the observations grouped by point");
  check(std::is_sorted(problem.ground_observations.begin(), problem.ground_observations.end(),
                       [](const GroundObservation& a, const GroundObservation& b) {
                         return std::make_pair(a.point, a.pose) < std::make_pair(b.point, b.pose);
                       }),
        "BundleProblem: expected ground_observations ordered by point, then by pose");
  check(problem.point_information.empty() || problem.point_information.size() == problem.points_in_map.size(),
        "BundleProblem: expected point_information of every point, or none");
  check(problem.vehicle_from_camera.empty() ||
            problem.vehicle_from_camera.size() == problem.rig->cameras.size(),
        "BundleProblem: expected vehicle_from_camera of every camera, or none");
  const auto prior_size = static_cast<Eigen::Index>(6 * problem.prior_vehicle_from_camera.size());
  check((prior_size == 0 || problem.prior_vehicle_from_camera.size() == problem.vehicle_from_camera.size()) &&
            problem.extrinsics_information.rows() == prior_size &&
            problem.extrinsics_information.cols() == prior_size,
        "BundleProblem: expected extrinsics_information and prior_vehicle_from_camera of every camera with "
        "unknown extrinsics, or none");
  const size_t num_deviations = problem.image_deviations.size();
  check(num_deviations == problem.prior_image_deviations.size() &&
            num_deviations == problem.image_deviation_sigmas.size() &&
            (num_deviations == 0 || num_deviations == problem.vehicle_from_camera.size()),
        "BundleProblem: expected image_deviations, their prior and sigmas of every camera with unknown "
        "extrinsics, or none");
  check(problem.rates.empty() || problem.rates.size() == problem.map_from_vehicle.size(),
        "BundleProblem: expected rates of every pose, or none");
  const size_t num_timings = problem.timing_deviations.size();
  check(
      num_timings == problem.prior_timing_deviations.size() &&
          num_timings == problem.timing_deviation_sigmas.size() &&
          (num_timings == 0 || (num_timings == problem.vehicle_from_camera.size() && !problem.rates.empty())),
      "BundleProblem: expected timing_deviations, their prior and sigmas of every camera with unknown "
      "extrinsics and rates, or none");
}

}  // namespace

BundleSolution solveBundle(int max_iterations, double cost_tolerance, BundleProblem* problem) {
  checkProblem(*problem);
  const BundleErrors errors(*problem);
  BundleEquations equations(*problem, errors);
  BundleState state = BundleState::of(*problem);
  BundleSolution solution;
  solution.cost = errors.cost(state);
  equations.linearize(state);
  double radius = kFirstRadius;
  double shrink = 2.0;
  BundleState next;
  while (solution.num_iterations < max_iterations && !solution.converged && radius > kMinRadius) {
    ++solution.num_iterations;
    const double expected = equations.step(1.0 / radius, &next);
    const double cost = expected > 0.0 ? errors.cost(next) : std::numeric_limits<double>::infinity();
    const double decrease = solution.cost - cost;
    solution.converged = std::abs(decrease) <= cost_tolerance * solution.cost;
    if (!(decrease > kMinGain * expected)) {
      radius /= shrink;
      shrink *= 2.0;
      continue;
    }
    radius = std::min(kMaxRadius,
                      radius / std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * decrease / expected - 1.0, 3)));
    shrink = 2.0;
    std::swap(state, next);
    solution.cost = cost;
    if (!solution.converged) {
      equations.linearize(state);
    }
  }
  problem->map_from_vehicle = std::move(state.poses);
  problem->points_in_map = std::move(state.points);
  problem->odometer = state.odometer;
  if (!problem->vehicle_from_camera.empty()) {
    problem->vehicle_from_camera = std::move(state.vehicle_from_camera);
    problem->image_deviations = std::move(state.image_deviations);
    problem->timing_deviations = std::move(state.timing_deviations);
  }
  return solution;
}

BundleCovariance bundleCovariance(const BundleProblem& problem) {
  checkProblem(problem);
  const BundleErrors errors(problem);
  BundleEquations equations(problem, errors);
  equations.linearize(BundleState::of(problem));
  return equations.covariance();
}

}  // namespace vcharge
