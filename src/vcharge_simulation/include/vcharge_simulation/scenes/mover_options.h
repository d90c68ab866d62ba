#pragma once

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Objects that move through the scenes lot, garage, obstacles and road. They follow lanes and pavements,
/// keep clear of all that stands, of each other and of the own car, which they know in advance: by 1.5 m,
/// those who walk up to it by 0.4 m. An object for which there is no such way is left out.
struct MoverOptions {
  VCHARGE_BEGIN_OPTIONS(MoverOptions);
  VCHARGE_OPTION(int, people, 0, between(0, 50), "Number of adults who walk, stand and turn back.");
  VCHARGE_OPTION(int, children, 0, between(0, 50), "Number of children.");
  VCHARGE_OPTION(int, cars, 0, between(0, 50), "Number of cars that pass, follow or leave a bay.");
  VCHARGE_OPTION(int, bicycles, 0, between(0, 50), "Number of bicycles with riders.");
  VCHARGE_OPTION(bool, crossing, false, anyValue(),
                 "One more adult crosses in front of the own car, far enough for a stop at 2.5 m/s^2.");
  VCHARGE_OPTION(int, approaching, 0, between(0, 50),
                 "Number of adults who walk straight up to the own car, at 0.5 to 2 m/s.");
  VCHARGE_OPTION(int, seed, 1, notNegative(), "Seed of looks and ways.");
  VCHARGE_END_OPTIONS();

  bool hasAny() const { return people + children + cars + bicycles + approaching > 0 || crossing; }
};

}  // namespace vcharge
