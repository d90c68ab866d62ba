#include <string_view>

#include "vcharge_dense/range_mapper.h"

namespace vcharge {

RangeMapperOptions RangeMapperOptions::offline() {
  RangeMapperOptions options;
  options.frames.waitForEverything();
  options.use_later_images = true;
  options.plane_sweep.aggregation = Aggregation::kReferenceSplit;
  return options;
}

void RangeMapperOptions::usePreset(RangePreset new_preset) {
  preset = new_preset;
  const PlaneSweepOptions default_sweep;
  neighbours.num_neighbours = NeighbourOptions().num_neighbours;
  plane_sweep.num_planes = default_sweep.num_planes;
  plane_sweep.num_ground_planes = default_sweep.num_ground_planes;
  plane_sweep.num_refinement_steps = default_sweep.num_refinement_steps;
  switch (preset) {
    case RangePreset::kFast:
      plane_sweep.num_planes = 40;
      plane_sweep.num_ground_planes = 8;
      plane_sweep.num_refinement_steps = 8;
      break;
    case RangePreset::kDefault:
      break;
    case RangePreset::kAccurate:
      neighbours.num_neighbours = 6;
      plane_sweep.num_planes = 96;
      break;
  }
}

void RangeMapperOptions::fieldWasRead(const char* field) {
  if (std::string_view(field) == "preset") {
    usePreset(preset);
  }
}

void RangeMapperOptions::checkFields() const {
  requireField(!use_later_images || neighbours.num_neighbours % 2 == 0, "neighbours.num_neighbours",
               "must be even where later images are used", neighbours.num_neighbours);
}

}  // namespace vcharge
