// Times and error distributions of the minimal solvers and OpenGV's, in the same run on the same problems.
// A solve is one call from prepared correspondences to all solutions.

#include <cstdio>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <opengv/absolute_pose/NoncentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>
#include <opengv/relative_pose/NoncentralRelativeAdapter.hpp>
#include <opengv/relative_pose/methods.hpp>

#include "solvers/random_problems.h"
#include "vcharge_geometry/solvers/ackermann_two_point.h"
#include "vcharge_geometry/solvers/generalized_three_point.h"
#include "vcharge_geometry/solvers/known_vertical_four_point.h"
#include "vcharge_geometry/solvers/perspective_three_point.h"
#include "vcharge_geometry/solvers/planar_three_point.h"
#include "vcharge_geometry/solvers/upright_two_point.h"

namespace vcharge {
namespace {

constexpr size_t kNumProblems = 1000;

/// Relative problems with known motion, as lines.
template <size_t N>
struct RelativeProblems {
  std::vector<RigidTransform> truths;
  std::vector<std::array<LineMatch, N>> matches;

  template <class Motion>
  explicit RelativeProblems(const Motion& motion) {
    RandomProblems random(1);
    for (size_t i = 0; i < kNumProblems; ++i) {
      truths.push_back(motion(&random));
      matches.push_back(random.lineMatches<N>(truths.back(), 0.5));
    }
  }
};

RigidTransform ackermannMotion(RandomProblems* random) {
  return RandomProblems::ackermannMotion(random->uniform(-0.5, 0.5), random->uniform(0.1, 2.0));
}
RigidTransform planarMotion(RandomProblems* random) {
  return RigidTransform::planar(random->normal(1.0), random->normal(1.0), random->uniform(-M_PI, M_PI));
}
RigidTransform uprightMotion(RandomProblems* random) {
  const RigidTransform planar = planarMotion(random);
  return RigidTransform(planar.rotation(),
                        planar.translation() + random->normal(0.3) * Eigen::Vector3d::UnitZ());
}
RigidTransform freeMotion(RandomProblems* random) {
  return RigidTransform(random->rotation(0.5), random->direction());
}

const RelativeProblems<2>& ackermannProblems() {
  static const RelativeProblems<2> problems(ackermannMotion);
  return problems;
}
const RelativeProblems<3>& planarProblems() {
  static const RelativeProblems<3> problems(planarMotion);
  return problems;
}
const RelativeProblems<4>& uprightProblems() {
  static const RelativeProblems<4> problems(uprightMotion);
  return problems;
}
const RelativeProblems<17>& freeProblems() {
  static const RelativeProblems<17> problems(freeMotion);
  return problems;
}

struct PoseProblems {
  std::vector<RigidTransform> truths;
  std::vector<std::array<PointMatch, 3>> matches;

  PoseProblems(bool upright, double spread) {
    RandomProblems random(2);
    for (size_t i = 0; i < kNumProblems; ++i) {
      truths.push_back(upright ? random.uprightPose() : random.pose());
      matches.push_back(random.pointMatches<3>(truths.back(), spread));
    }
  }
};

const PoseProblems& poseProblems() {
  static const PoseProblems problems(false, 1.0);
  return problems;
}
const PoseProblems& centralPoseProblems() {
  static const PoseProblems problems(false, 0.0);
  return problems;
}
const PoseProblems& uprightPoseProblems() {
  static const PoseProblems problems(true, 1.0);
  return problems;
}

/// Each correspondence becomes a separate "camera" for OpenGV, at the point of its line closest to the
/// origin. The lines, and therefore the problems, are the same.
template <size_t N>
struct OpengvRelative {
  opengv::bearingVectors_t previous, current;
  std::vector<int> previous_cameras, current_cameras;
  opengv::translations_t offsets;
  opengv::rotations_t rotations;
  std::vector<int> indices;

  explicit OpengvRelative(const std::array<LineMatch, N>& matches) {
    for (const LineMatch& match : matches) {
      indices.push_back(static_cast<int>(indices.size()));
      previous.push_back(match.previous.direction);
      current.push_back(match.current.direction);
      for (const PlueckerLine* line : {&match.previous, &match.current}) {
        (line == &match.previous ? previous_cameras : current_cameras)
            .push_back(static_cast<int>(offsets.size()));
        offsets.push_back(line->direction.cross(line->moment_m));
        rotations.push_back(Eigen::Matrix3d::Identity());
      }
    }
  }
  opengv::relative_pose::NoncentralRelativeAdapter adapter() const {
    return {previous, current, previous_cameras, current_cameras, offsets, rotations};
  }
};

struct OpengvAbsolute {
  opengv::bearingVectors_t bearings;
  std::vector<int> cameras;
  opengv::points_t points;
  opengv::translations_t offsets;
  opengv::rotations_t rotations;
  std::vector<int> indices{0, 1, 2};

  explicit OpengvAbsolute(const std::array<PointMatch, 3>& matches) {
    for (const PointMatch& match : matches) {
      cameras.push_back(static_cast<int>(cameras.size()));
      bearings.push_back(match.ray.direction);
      points.push_back(match.point_m);
      offsets.push_back(match.ray.origin_m);
      rotations.push_back(Eigen::Matrix3d::Identity());
    }
  }
  opengv::absolute_pose::NoncentralAbsoluteAdapter adapter() const {
    return {bearings, cameras, points, offsets, rotations};
  }
};

/// Solutions of one problem.
using Transforms = std::vector<RigidTransform>;

template <class Solutions>
Transforms transformsOf(const Solutions& solutions) {
  Transforms transforms;
  for (const auto& solution : solutions) {
    transforms.push_back(solution.transform());
  }
  return transforms;
}

double errorOf(const Transforms& solutions, const RigidTransform& truth) {
  double smallest = INFINITY;
  for (const RigidTransform& solution : solutions) {
    smallest = std::min(smallest, transformError(solution, truth));
  }
  return smallest;
}

/// Measures `solve(problem)` over all problems, then fills the counters with the distribution of
/// `error(result, i)`.
template <class Problem, class Solve, class Error>
void measure(benchmark::State& state, const std::vector<Problem>& problems, const Solve& solve,
             const Error& error) {
  size_t next = 0;
  for (auto unused : state) {
    (void)unused;
    benchmark::DoNotOptimize(solve(problems[next]));
    next = next + 1 == problems.size() ? 0 : next + 1;
  }
  std::vector<double> errors;
  for (size_t i = 0; i < problems.size(); ++i) {
    errors.push_back(error(solve(problems[i]), i));
  }
  state.counters["solved_1e-6"] =
      static_cast<double>(std::count_if(errors.begin(), errors.end(), [](double e) { return e < 1e-6; })) /
      static_cast<double>(errors.size());
  state.counters["median"] = quantile(errors, 0.5);
  state.counters["q90"] = quantile(errors, 0.9);
  state.counters["q99"] = quantile(errors, 0.99);
}

/// Measures a solver of this package: solver(matches, solutions).
template <class Solutions, class Problem, class Solver>
void measureOurs(benchmark::State& state, const std::vector<Problem>& problems,
                 const std::vector<RigidTransform>& truths, const Solver& solver) {
  measure(
      state, problems,
      [&](const Problem& problem) {
        Solutions solutions;
        solver(problem, &solutions);
        return solutions;
      },
      [&](const Solutions& solutions, size_t i) { return errorOf(transformsOf(solutions), truths[i]); });
}

void ackermannTwoPoint(benchmark::State& state) {
  measureOurs<FixedVector<YawMotion, 3>>(state, ackermannProblems().matches, ackermannProblems().truths,
                                         solveAckermannTwoPoint);
}
void planarThreePoint(benchmark::State& state) {
  measureOurs<FixedVector<YawMotion, 4>>(state, planarProblems().matches, planarProblems().truths,
                                         solvePlanarThreePoint);
}
void knownVerticalFourPoint(benchmark::State& state) {
  measureOurs<FixedVector<YawMotion, 6>>(state, uprightProblems().matches, uprightProblems().truths,
                                         solveKnownVerticalFourPoint);
}
void generalizedThreePoint(benchmark::State& state) {
  measureOurs<FixedVector<RotationTranslation, 8>>(state, poseProblems().matches, poseProblems().truths,
                                                   solveGeneralizedThreePoint);
}
void perspectiveThreePoint(benchmark::State& state) {
  measureOurs<FixedVector<RotationTranslation, 4>>(state, centralPoseProblems().matches,
                                                   centralPoseProblems().truths, solvePerspectiveThreePoint);
}
void uprightTwoPoint(benchmark::State& state) {
  measureOurs<FixedVector<RotationTranslation, 2>>(
      state, uprightPoseProblems().matches, uprightPoseProblems().truths,
      [](const std::array<PointMatch, 3>& matches, FixedVector<RotationTranslation, 2>* poses) {
        return solveUprightTwoPoint({matches[0], matches[1]}, poses);
      });
}

std::vector<OpengvRelative<17>> opengvFreeProblems() {
  return {freeProblems().matches.begin(), freeProblems().matches.end()};
}

void opengvSeventeenPoint(benchmark::State& state) {
  measure(
      state, opengvFreeProblems(),
      [](const OpengvRelative<17>& problem) {
        const auto adapter = problem.adapter();
        return opengv::relative_pose::seventeenpt(adapter, problem.indices);
      },
      [](const opengv::transformation_t& motion, size_t i) {
        return transformError(RigidTransform::fromMatrix(motion), freeProblems().truths[i]);
      });
}

/// The six-point solver returns rotations only, so its errors are those of the rotation.
void opengvSixPoint(benchmark::State& state) {
  std::vector<OpengvRelative<6>> problems;
  for (size_t i = 0; i < 200; ++i) {
    std::array<LineMatch, 6> matches;
    std::copy_n(freeProblems().matches[i].begin(), 6, matches.begin());
    problems.emplace_back(matches);
  }
  measure(
      state, problems,
      [](const OpengvRelative<6>& problem) {
        const auto adapter = problem.adapter();
        return opengv::relative_pose::sixpt(adapter, problem.indices);
      },
      [](const opengv::rotations_t& rotations, size_t i) {
        double smallest = INFINITY;
        for (const Eigen::Matrix3d& rotation : rotations) {
          smallest = std::min(smallest, angleOfRotation(Eigen::Quaterniond(rotation).conjugate() *
                                                        freeProblems().truths[i].rotation()));
        }
        return smallest;
      });
}

void opengvGeneralizedThreePoint(benchmark::State& state) {
  const std::vector<OpengvAbsolute> problems(poseProblems().matches.begin(), poseProblems().matches.end());
  measure(
      state, problems,
      [](const OpengvAbsolute& problem) {
        const auto adapter = problem.adapter();
        return opengv::absolute_pose::gp3p(adapter, problem.indices);
      },
      [](const opengv::transformations_t& poses, size_t i) {
        Transforms transforms;
        for (const opengv::transformation_t& pose : poses) {
          if (pose.allFinite()) {
            transforms.push_back(RigidTransform::fromMatrix(pose));
          }
        }
        return errorOf(transforms, poseProblems().truths[i]);
      });
}

BENCHMARK(ackermannTwoPoint);
BENCHMARK(planarThreePoint);
BENCHMARK(knownVerticalFourPoint);
BENCHMARK(generalizedThreePoint);
BENCHMARK(perspectiveThreePoint);
BENCHMARK(uprightTwoPoint);
BENCHMARK(opengvSeventeenPoint);
BENCHMARK(opengvSixPoint);
BENCHMARK(opengvGeneralizedThreePoint);

/// The console report, which also keeps the times to compute ratios.
class RatioReporter : public benchmark::ConsoleReporter {
 public:
  RatioReporter() : benchmark::ConsoleReporter(OO_Tabular) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    benchmark::ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      times_.emplace_back(run.benchmark_name(), run.GetAdjustedCPUTime());
    }
  }
  double timeOf(const std::string& name) const {
    for (const auto& [benchmark_name, time] : times_) {
      if (benchmark_name == name) {
        return time;
      }
    }
    return NAN;
  }

 private:
  std::vector<std::pair<std::string, double>> times_;
};

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  vcharge::RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  const auto printRatio = [&](const char* slow, const char* fast) {
    std::printf("%s / %s: %.1f\n", slow, fast, reporter.timeOf(slow) / reporter.timeOf(fast));
  };
  printRatio("opengvSeventeenPoint", "ackermannTwoPoint");
  printRatio("opengvSixPoint", "ackermannTwoPoint");
  printRatio("opengvGeneralizedThreePoint", "generalizedThreePoint");
  return 0;
}
