#pragma once

#include <optional>

#include "scenes/movers/own_car.h"
#include "scenes/movers/planned_mover.h"
#include "scenes/movers/standing_obstacles.h"
#include "scenes/movers/ways/mover_routes.h"

namespace vcharge {

/// What a mover has to do with the own car.
enum class Purpose { kNone, kCrossing, kApproaching };

/// A mover with a path that is free of all that stands; its schedule is still to be found.
struct Way {
  PlannedMover mover;
  ScheduleTask task;   ///< without is_free and speed_limit_m_per_s
  double end_m = 0.0;  ///< the path is free up to here
  /// A person who crosses the own car's way must have passed `along_m` at `time_s`.
  struct Crossing {
    double time_s, along_m;
  };
  std::optional<Crossing> crossing;
  Purpose purpose = Purpose::kNone;
  /// Distance kept from the own car's footprint.
  double ownClearance_m() const {
    return purpose == Purpose::kApproaching ? kApproachClearance_m : kOwnClearance_m;
  }
};

/// Chooses at random what movers are and where they go.
class WayChooser {
 public:
  /// The arguments must outlive this object.
  WayChooser(const MoverArea& area, const StandingObstacles& obstacles, const OwnCar& own_car, int num_steps)
      : area_(area), obstacles_(obstacles), own_car_(own_car), num_steps_(num_steps) {}

  /// Nothing if what was chosen is blocked.
  std::optional<Way> choose(ObjectClass object_class, Purpose purpose, Random* random) const;

 private:
  void wantPauses(Random* random, double standing_part, ScheduleTask* task) const;
  void makePerson(Random* random, Way* way) const;
  bool chooseWalk(Random* random, Way* way) const;
  bool chooseCrossing(Random* random, Way* way) const;
  bool chooseApproach(Random* random, Way* way) const;
  bool chooseCar(Random* random, Way* way) const;
  bool leaveAnyBay(Random* random, double aside_m, Way* way) const;
  bool chooseBicycle(Random* random, Way* way) const;
  bool chooseLaneDrive(Random* random, double aside_m, Way* way) const;
  void startBehindOwnCar(Way* way) const;
  bool isFreeLap(double lap_m, Way* way) const;
  bool isFreeFor(double least_m, Way* way) const;

  const MoverArea& area_;
  const StandingObstacles& obstacles_;
  const OwnCar& own_car_;
  const int num_steps_;
};

}  // namespace vcharge
