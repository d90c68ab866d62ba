#include "scenes/movers/mover_planner.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "scenes/movers/way_chooser.h"

namespace vcharge {

namespace {

constexpr int kAttempts = 60;
constexpr double kMoverClearance_m = 0.4;
// Movers keep out of where the own car will be within this time.
constexpr double kOwnHorizon_s = 3.0;
constexpr double kMaxLateralAcceleration_m_per_s2 = 1.5;

constexpr int kChecksPerStep = 5;
constexpr double kCheckStep_s = SpeedSchedule::kStep_s / kChecksPerStep;

// Something that moves already: its outlines kCheckStep_s apart, and how far it moves within half a step of a
// schedule.
struct Moving {
  std::vector<Footprint> outlines;
  double margin_m;
};

class Planner {
 public:
  Planner(const MoverArea& area, const Scene& scene, const OwnCar& own_car, double start_s)
      : own_car_(own_car),
        num_steps_(static_cast<int>(std::ceil(own_car.duration() / SpeedSchedule::kStep_s)) + 1),
        obstacles_(scene, area.bounds),
        chooser_(area, obstacles_, own_car, num_steps_) {
    for (const Mover& mover : scene.movers) {
      addMoving([&](double time_s) { return mover.stateAt(start_s + time_s); });
    }
  }

  void add(ObjectClass object_class, Purpose purpose, uint64_t seed) {
    Random random(seed);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      std::optional<Way> way = chooser_.choose(object_class, purpose, &random);
      if (way && schedule(&*way)) {
        movers_.push_back(way->mover);
        addMoving([&](double time_s) { return way->mover.stateAt(time_s); });
        return;
      }
    }
  }

  std::vector<PlannedMover> take() { return std::move(movers_); }

 private:
  template <class StateAt>
  void addMoving(const StateAt& stateAt) {
    Moving moving{{}, 0.0};
    double fastest = 0.0;
    for (int check = 0; check <= kChecksPerStep * num_steps_; ++check) {
      const MoverState state = stateAt(kCheckStep_s * check);
      moving.outlines.emplace_back(state.obstacle.footprint_m);
      fastest = std::max(fastest, state.velocity_m_per_s.norm());
    }
    moving.margin_m = 0.5 * SpeedSchedule::kStep_s * fastest;
    moving_.push_back(std::move(moving));
  }

  /// Time for which a mover keeps clear of where the own car will be.
  double horizonAt(double time_s, bool is_near) const {
    return is_near ? 0.5 * own_car_.speedAt(time_s) / kStop_m_per_s2 + kReaction_s : kOwnHorizon_s;
  }

  bool schedule(Way* way) const {
    PlannedMover* mover = &way->mover;
    ScheduleTask* task = &way->task;
    const bool crossing = way->crossing.has_value();
    const bool is_near = way->purpose != Purpose::kNone;
    const MoverPath& path = *mover->path;
    task->path_m = way->end_m - mover->start_m;
    task->speed_limit_m_per_s = [&](double along_m) {
      const double curvature = std::abs(path.curvature(mover->start_m + along_m));
      return curvature > 0.0 ? std::sqrt(kMaxLateralAcceleration_m_per_s2 / curvature) : 1e3;
    };
    std::vector<Footprint> outlines;
    const int cells =
        std::min(static_cast<int>(task->path_m / task->cell_m()), 2 * task->num_speeds * task->num_steps);
    for (int cell = 0; cell <= cells; ++cell) {
      outlines.emplace_back(mover->outlineAt(cell * task->cell_m()));
    }
    task->is_free = [&](int step, double along_m) {
      const Footprint& outline = outlines[static_cast<size_t>(std::lround(along_m / task->cell_m()))];
      const double time_s = SpeedSchedule::kStep_s * step;
      const bool is_free_of_movers = std::none_of(moving_.begin(), moving_.end(), [&](const Moving& moving) {
        return isNearerThan(kMoverClearance_m + moving.margin_m + task->margin_m(), outline,
                            moving.outlines[static_cast<size_t>(kChecksPerStep * step)]);
      });
      return is_free_of_movers && own_car_.keepsClearOf(outline, time_s, horizonAt(time_s, is_near),
                                                        way->ownClearance_m() + task->margin_m());
    };
    const std::optional<SpeedSchedule> found = planSchedule(*task);
    if (!found) {
      return false;
    }
    mover->schedule = std::make_shared<const SpeedSchedule>(*found);
    if (crossing && found->at(way->crossing->time_s).along_m < way->crossing->along_m) {
      return false;
    }
    for (int check = 0; check <= kChecksPerStep * num_steps_; ++check) {
      const double time_s = kCheckStep_s * check;
      const Footprint outline(mover->outlineAt(found->at(time_s).along_m));
      const bool meets_mover = std::any_of(moving_.begin(), moving_.end(), [&](const Moving& moving) {
        return isNearerThan(kMoverClearance_m, outline, moving.outlines[static_cast<size_t>(check)]);
      });
      if (meets_mover || !own_car_.keepsClearOf(outline, time_s, 0.0, way->ownClearance_m())) {
        return false;
      }
    }
    return true;
  }

  const OwnCar& own_car_;
  const int num_steps_;
  const StandingObstacles obstacles_;
  const WayChooser chooser_;
  std::vector<Moving> moving_;
  std::vector<PlannedMover> movers_;
};

}  // namespace

std::vector<PlannedMover> planMovers(const MoverOptions& options, const MoverArea& area, const Scene& scene,
                                     const OwnCar& own_car, double start_s) {
  Planner planner(area, scene, own_car, start_s);
  const auto seed = static_cast<uint64_t>(options.seed) * 1000003U;
  if (options.crossing) {
    planner.add(ObjectClass::kAdult, Purpose::kCrossing, seed);
  }
  for (int i = 0; i < options.approaching; ++i) {
    planner.add(ObjectClass::kAdult, Purpose::kApproaching,
                seed + 900000U + static_cast<uint64_t>(i));  // apart from the other seeds
  }
  for (const auto& [object_class, count] :
       {std::pair(ObjectClass::kCar, options.cars), std::pair(ObjectClass::kBicycle, options.bicycles),
        std::pair(ObjectClass::kAdult, options.people), std::pair(ObjectClass::kChild, options.children)}) {
    for (int i = 0; i < count; ++i) {
      planner.add(object_class, Purpose::kNone,
                  seed + 1000U * static_cast<uint64_t>(object_class) + static_cast<uint64_t>(i) + 1U);
    }
  }
  return planner.take();
}

}  // namespace vcharge
