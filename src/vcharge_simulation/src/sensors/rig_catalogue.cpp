#include "vcharge_simulation/sensors/rig_catalogue.h"

#include <functional>
#include <stdexcept>

#include "vcharge_simulation/sensors/golf_rig.h"

namespace vcharge {

namespace {

struct CatalogueRig {
  CatalogueEntry entry;
  std::function<CameraRig(uint64_t, double)> make;
};

const std::vector<CatalogueRig>& catalogue() {
  static const std::vector<CatalogueRig> rigs = {
      {{"golf", "four 185-degree cameras as on the V-Charge car, varied slightly by --rig-seed"},
       makeGolfRig},
      {{"recessed",
        "the Golf's cameras set back, so that bonnet, tailgate and doors fill more of the images"},
       makeRecessedRig},
      {{"random",
        "the Golf's cameras moved by up to 10 cm and 10 degrees, with random lenses, by --rig-seed"},
       makeRandomRig},
      {{"eight",
        "the Golf's cameras, two that look back along the sides, one on the roof, one for a trailer"},
       makeEightRig}};
  return rigs;
}

}  // namespace

std::vector<CatalogueEntry> listRigs() {
  std::vector<CatalogueEntry> entries;
  for (const CatalogueRig& rig : catalogue()) {
    entries.push_back(rig.entry);
  }
  return entries;
}

CameraRig makeRig(const std::string& name, uint64_t seed, double image_scale) {
  std::string names;
  for (const CatalogueRig& rig : catalogue()) {
    if (rig.entry.name == name) {
      return rig.make(seed, image_scale);
    }
    names += (names.empty() ? "" : ", ") + rig.entry.name;
  }
  throw std::invalid_argument("rig: expected one of " + names + ", got '" + name + "'");
}

}  // namespace vcharge
