#include "scenes/lot/parking_bays.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;

ParkedCar parkedCar(const ParkingBay& bay, Random* random) {
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

}  // namespace

std::vector<ParkingBay> baysToLeave(const std::vector<ParkingBay>& bays) {
  std::vector<ParkingBay> chosen;
  std::copy_if(bays.begin(), bays.end(), std::back_inserter(chosen),
               [](const ParkingBay& bay) { return !bay.is_oblique; });
  return chosen;
}

std::vector<ParkedCar> parkCars(const std::vector<ParkingBay>& bays, double occupied_fraction, uint64_t seed,
                                const Day& day) {
  std::vector<ParkedCar> cars;
  for (const ParkingBay& bay : bays) {
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
