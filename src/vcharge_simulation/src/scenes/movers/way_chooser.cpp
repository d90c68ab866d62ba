#include "scenes/movers/way_chooser.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vcharge_simulation/objects/car_model.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kAdultRadius_m = 0.35;
constexpr double kAdultHeight_m = 1.78;
constexpr double kMaxStart_m = 250.0;
constexpr double kApproachStep_m = 0.05;

void setPath(DrivePath path, Way* way) {
  way->mover.path = std::make_shared<const MoverPath>(std::move(path));
  way->end_m = way->mover.path->length();
}

// Stands until then.
void startAt(double go_s, ScheduleTask* task) {
  task->wanted_m_per_s = [go_s, speed = task->max_speed_m_per_s](int step) {
    return SpeedSchedule::kStep_s * step < go_s ? 0.0 : speed;
  };
}

}  // namespace

std::optional<Way> WayChooser::choose(ObjectClass object_class, Purpose purpose, Random* random) const {
  Way way;
  way.purpose = purpose;
  way.mover.object_class = object_class;
  way.mover.look = static_cast<uint32_t>(random->bits());
  way.task.num_steps = num_steps_;
  const bool is_free = object_class == ObjectClass::kCar       ? chooseCar(random, &way)
                       : object_class == ObjectClass::kBicycle ? chooseBicycle(random, &way)
                       : purpose == Purpose::kCrossing         ? chooseCrossing(random, &way)
                       : purpose == Purpose::kApproaching      ? chooseApproach(random, &way)
                                                               : chooseWalk(random, &way);
  return is_free ? std::optional<Way>(std::move(way)) : std::nullopt;
}

// Stands and moves in turn.
void WayChooser::wantPauses(Random* random, double standing_part, ScheduleTask* task) const {
  std::vector<bool> stands;
  bool standing = random->chance(standing_part);
  while (static_cast<int>(stands.size()) <= num_steps_) {
    const double length_s = standing ? random->uniform(2.0, 8.0)
                                     : random->uniform(3.0, 12.0) * (0.2 / std::max(0.01, standing_part));
    stands.insert(stands.end(), static_cast<size_t>(std::ceil(length_s / SpeedSchedule::kStep_s)), standing);
    standing = !standing;
  }
  task->wanted_m_per_s = [stands, speed = task->max_speed_m_per_s](int step) {
    return stands[static_cast<size_t>(step)] ? 0.0 : speed;
  };
}

void WayChooser::makePerson(Random* random, Way* way) const {
  const bool is_child = way->mover.object_class == ObjectClass::kChild;
  way->mover.size = is_child ? random->uniform(0.56, 0.74) : random->uniform(0.93, 1.06);
  way->mover.width_m = 2.0 * kAdultRadius_m * (is_child ? 0.75 : 1.0);
  way->mover.height_m = kAdultHeight_m * way->mover.size;
  way->task.num_speeds = 3;
  way->task.max_speed_m_per_s = is_child ? random->uniform(0.8, 1.5) : random->uniform(0.9, 1.6);
}

// A walk near the own car's way, so that it is seen.
bool WayChooser::chooseWalk(Random* random, Way* way) const {
  makePerson(random, way);
  const RigidTransform& own = own_car_.poseAt(random->uniform(0.0, own_car_.duration()));
  const double angle_rad = random->uniform(-kPi, kPi);
  const double away_m = random->uniform(3.0, 14.0);
  const Eigen::Vector3d at =
      own.translation() + away_m * Eigen::Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0.0);
  const double yaw_rad = yawOfRotation(own.rotation()) + 0.5 * kPi * random->index(4) +
                         (random->chance(0.5) ? 0.0 : random->uniform(-0.3, 0.3));
  const double leg_m = random->uniform(2.0, way->mover.object_class == ObjectClass::kChild ? 8.0 : 16.0);
  const double radius_m = random->uniform(0.4, 0.6);
  const double lap_m = 2.0 * (leg_m + kPi * radius_m + 0.3);
  setPath(walkBackAndForth(RigidTransform::planar(at.x(), at.y(), yaw_rad), leg_m, radius_m,
                           way->task.max_speed_m_per_s * (own_car_.duration() + 2.0) + lap_m),
          way);
  way->mover.start_m = random->uniform(0.0, lap_m);
  wantPauses(random, random->chance(0.15) ? 0.9 : 0.25, &way->task);
  return isFreeLap(lap_m, way);
}

// Straight across the own car's way, so early that the own car can still stop.
bool WayChooser::chooseCrossing(Random* random, Way* way) const {
  makePerson(random, way);
  way->task.max_speed_m_per_s = random->uniform(1.2, 1.6);
  const double met_s = random->uniform(0.25, 0.9) * own_car_.duration();
  const double half_m = random->uniform(3.5, 7.0);
  const RigidTransform front =
      own_car_.poseAt(met_s) * RigidTransform::planar(carShapes().front().front(), 0.0, 0.0);
  const double yaw_rad = yawOfRotation(front.rotation()) + (random->chance(0.5) ? 0.5 : -0.5) * kPi;
  const Eigen::Vector3d from =
      front.translation() - half_m * Eigen::Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), 0.0);
  setPath(DrivePath(RigidTransform::planar(from.x(), from.y(), yaw_rad), {{2.0 * half_m, 0.0, 0.0}}), way);
  const double go_s = met_s - half_m / way->task.max_speed_m_per_s - random->uniform(2.0, 4.0);
  startAt(go_s, &way->task);
  // Already on the way at the start of a short drive.
  way->mover.start_m = std::max(0.0, -go_s * way->task.max_speed_m_per_s);
  way->crossing = Way::Crossing{met_s, half_m - way->mover.start_m};
  return way->mover.start_m < 0.5 * half_m && own_car_.speedAt(met_s) > 0.5 && isFreeLap(2.0 * half_m, way);
}

// Straight up to where the own car is when the walk begins; stays there.
bool WayChooser::chooseApproach(Random* random, Way* way) const {
  makePerson(random, way);
  way->task.max_speed_m_per_s = random->uniform(0.5, 2.0);
  const double go_s = random->uniform(0.0, 0.5) * own_car_.duration();
  const Footprint& own = own_car_.footprintAt(go_s);
  const double angle_rad = random->uniform(-kPi, kPi);
  const Eigen::Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
  const double from_m = random->uniform(6.0, 9.0);
  const Eigen::Vector2d from = own.centre + from_m * direction;
  setPath(DrivePath(RigidTransform::planar(from.x(), from.y(), angle_rad + kPi), {{from_m, 0.0, 0.0}}), way);
  const double nearest_m = way->ownClearance_m() + way->task.margin_m();
  way->end_m = 0.0;
  while (!isNearerThan(nearest_m, Footprint(way->mover.outlineAt(way->end_m + kApproachStep_m)), own)) {
    way->end_m += kApproachStep_m;
  }
  startAt(go_s, &way->task);
  return isFreeLap(way->end_m, way);
}

bool WayChooser::chooseCar(Random* random, Way* way) const {
  way->mover.car_shape = random->index(static_cast<int>(carShapes().size()));
  const CarShape& shape = carShapes()[static_cast<size_t>(way->mover.car_shape)];
  way->mover.length_m = shape.length;
  way->mover.width_m = shape.width;
  way->mover.height_m = shape.height;
  way->mover.middle_m = 0.5 * (shape.front() + shape.rear());
  way->task.num_speeds = 6;
  way->task.max_speed_m_per_s = area_.is_road ? random->uniform(5.0, 9.0) : random->uniform(2.0, 3.5);
  const double aside_m = area_.is_road ? 1.7 : random->uniform(0.6, 1.4);
  return !area_.bays.empty() && random->chance(0.35) ? leaveAnyBay(random, aside_m, way)
                                                     : chooseLaneDrive(random, aside_m, way);
}

bool WayChooser::leaveAnyBay(Random* random, double aside_m, Way* way) const {
  const auto number = static_cast<size_t>(random->index(static_cast<int>(area_.bays.size())));
  const std::optional<DrivePath> path =
      leaveBay(area_, area_.bays[number], way->mover.middle_m, aside_m, random->chance(0.5));
  if (!path) {
    return false;
  }
  setPath(*path, way);
  const double go_s = random->uniform(0.0, 0.5 * std::min(own_car_.duration(), 30.0));
  startAt(go_s, &way->task);
  return isFreeFor(10.0, way);
}

bool WayChooser::chooseBicycle(Random* random, Way* way) const {
  way->mover.length_m = 1.8;
  way->mover.width_m = 0.62;
  way->mover.height_m = 1.72;
  way->mover.middle_m = 0.55;
  way->task.num_speeds = 6;
  way->task.max_speed_m_per_s = random->uniform(2.2, 4.5);
  return chooseLaneDrive(random, area_.is_road ? 2.6 : random->uniform(0.6, 1.7), way);
}

bool WayChooser::chooseLaneDrive(Random* random, double aside_m, Way* way) const {
  const double way_m = way->task.max_speed_m_per_s * (own_car_.duration() + 2.0);
  setPath(driveAround(area_, aside_m, way_m + kMaxStart_m, random), way);
  way->mover.start_m =
      random->uniform(0.0, std::max(1.0, std::min(kMaxStart_m, way->mover.path->length() - 30.0)));
  if (random->chance(0.4)) {
    startBehindOwnCar(way);
  }
  wantPauses(random, random->chance(0.3) ? 0.2 : 0.02, &way->task);
  return isFreeFor(10.0, way);
}

// Moves the start to where the mover follows the own car, if its path leads there.
void WayChooser::startBehindOwnCar(Way* way) const {
  const RigidTransform& own = own_car_.poseAt(0.0);
  for (double along_m = 0.0; along_m < std::min(kMaxStart_m, way->mover.path->length()); along_m += 0.5) {
    const RigidTransform here = own.inverse() * way->mover.poseAt(along_m - way->mover.start_m);
    const bool is_behind = here.translation().x() > -12.0 && here.translation().x() < -7.0 &&
                           std::abs(here.translation().y()) < 4.0;
    if (is_behind && std::abs(yawOfRotation(here.rotation())) < 0.3) {
      way->mover.start_m = along_m;
      return;
    }
  }
}

// For paths that are repeated.
bool WayChooser::isFreeLap(double lap_m, Way* way) const {
  way->mover.ground_z_m = obstacles_.groundUnder(way->mover);
  return obstacles_.freeLength(0.0, lap_m, way->mover) >= lap_m;
}

// Ends the way before the first obstacle, or where the drive ends. False if less than `least_m` of a longer
// way is left.
bool WayChooser::isFreeFor(double least_m, Way* way) const {
  const double start_m = way->mover.start_m;
  const double reach_m =
      std::min(way->task.max_speed_m_per_s * SpeedSchedule::kStep_s * num_steps_, way->end_m - start_m);
  const double free_m = obstacles_.freeLength(start_m, start_m + reach_m, way->mover);
  way->end_m = start_m + free_m;
  return free_m >= std::min(least_m, reach_m - 1e-6);
}

}  // namespace vcharge
