#include "scenes/lot/parking_bays.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;

ParkedCar parkedCar(const PlannedBay& bay, Random* random) {
  ParkedCar car{};
  car.shape = random->index(static_cast<int>(carShapes().size()));
  car.paint = random->index(5);
  car.seed = static_cast<uint32_t>(random->bits());
  car.yaw_rad = bay.yaw_rad + random->normal() * 0.02;
  car.yaw_rad += random->chance(0.5) ? kPi : 0.0;
  const CarShape& shape = carShapes()[static_cast<size_t>(car.shape)];
  // The centre of the car, not its rear axle, is at the centre of the bay.
  const double middle = 0.5 * (shape.front() + shape.rear());
  const double along = random->normal() * 0.12;
  const double across = random->normal() * 0.1;
  const double c = std::cos(car.yaw_rad);
  const double s = std::sin(car.yaw_rad);
  car.x = bay.x - c * (middle + along) - s * across;
  car.y = bay.y - s * (middle + along) + c * across;
  return car;
}

/// The axes of a bay from its middle: towards its end, and to the left of that.
struct BayAxes {
  Eigen::Vector2d middle, into, left;
  double half_length, half_width;

  explicit BayAxes(const PlannedBay& bay) : middle(bay.x, bay.y) {
    const bool is_parallel = bay.kind == BayKind::kParallel;
    into = is_parallel ? Eigen::Vector2d(0.0, bay.is_north_of_lane ? 1.0 : -1.0)
                       : Eigen::Vector2d(std::cos(bay.yaw_rad), std::sin(bay.yaw_rad));
    left = {-into.y(), into.x()};
    half_length = 0.5 * (is_parallel ? kParallelWidth_m : bay.length_m);
    half_width = 0.5 * (is_parallel ? kParallelLength_m : kBayWidth_m);
  }

  Eigen::Vector2d at(double along, double aside) const { return middle + along * into + aside * left; }
  /// Position along and aside.
  Eigen::Vector2d coordinatesOf(const Eigen::Vector2d& position) const {
    return {into.dot(position - middle), left.dot(position - middle)};
  }
};

/// First and last place of the line on one side of a bay, along it. Angled bays share lines with neighbours.
std::pair<double, double> lineOf(const PlannedBay& bay, double side, const std::vector<PlannedBay>& bays) {
  const BayAxes axes(bay);
  std::pair<double, double> line(-axes.half_length, axes.half_length);
  if (bay.kind != BayKind::kAngled) {
    return line;
  }
  for (const PlannedBay& other : bays) {
    const Eigen::Vector2d to_other = axes.coordinatesOf({other.x, other.y});
    if (other.kind == bay.kind && std::abs(other.yaw_rad - bay.yaw_rad) < 1e-6 &&
        std::abs(to_other.y() - side * kBayWidth_m) < 0.01 && std::abs(to_other.x()) < bay.length_m) {
      line.first = std::min(line.first, to_other.x() - axes.half_length);
      line.second = std::max(line.second, to_other.x() + axes.half_length);
    }
  }
  return line;
}

}  // namespace

std::vector<ParkingBay> paintedBays(const std::vector<PlannedBay>& bays, const std::vector<ParkedCar>& cars) {
  std::vector<ParkingBay> painted;
  for (size_t i = 0; i < bays.size(); ++i) {
    const BayAxes axes(bays[i]);
    const auto left = lineOf(bays[i], 1.0, bays), right = lineOf(bays[i], -1.0, bays);
    const double half = axes.half_width;
    ParkingBay bay;
    bay.id = static_cast<uint32_t>(bays[i].number);
    if (i > 0) {
      const bool is_same = bays[i].y == bays[i - 1].y && bays[i].yaw_rad == bays[i - 1].yaw_rad;
      bay.row = painted.back().row + (is_same ? 0 : 1);
    }
    bay.kind = bays[i].kind;
    bay.corners_m = {axes.at(left.first, half), axes.at(right.first, -half), axes.at(right.second, -half),
                     axes.at(left.second, half)};
    bay.confidence = 1.0;
    bay.state = std::any_of(cars.begin(), cars.end(),
                            [&](const ParkedCar& car) {
                              Eigen::Vector2d centre = Eigen::Vector2d::Zero();
                              const std::vector<Eigen::Vector2d> outline = obstacleOf(car).footprint_m;
                              for (const Eigen::Vector2d& corner : outline) {
                                centre += corner / static_cast<double>(outline.size());
                              }
                              const Eigen::Vector2d found = axes.coordinatesOf(centre).cwiseAbs();
                              return found.x() < axes.half_length && found.y() < axes.half_width;
                            })
                    ? BayState::kOccupied
                    : BayState::kFree;
    painted.push_back(bay);
  }
  return painted;
}

std::vector<PlannedBay> baysToLeave(const std::vector<PlannedBay>& bays) {
  std::vector<PlannedBay> chosen;
  std::copy_if(bays.begin(), bays.end(), std::back_inserter(chosen),
               [](const PlannedBay& bay) { return bay.kind == BayKind::kPerpendicular; });
  return chosen;
}

std::vector<ParkedCar> parkCars(const std::vector<PlannedBay>& bays, double occupied_fraction, uint64_t seed,
                                const Day& day) {
  std::vector<ParkedCar> cars;
  for (const PlannedBay& bay : bays) {
    const uint64_t bay_seed = seed * 1000003U + static_cast<uint64_t>(bay.number);
    Random random(bay_seed);
    bool occupied = random.chance(occupied_fraction);
    if (day.exchangedCars() > 0.0) {
      Random other_day(bay_seed * 31U + static_cast<uint64_t>(day.number));
      if (other_day.chance(day.exchangedCars())) {
        occupied = other_day.chance(occupied_fraction);
        random = other_day;
      }
    }
    if (occupied && !bay.keep_free) {
      cars.push_back(parkedCar(bay, &random));
    }
  }
  return cars;
}

}  // namespace vcharge
