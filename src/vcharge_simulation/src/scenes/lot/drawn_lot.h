#pragma once

#include <cstdint>

#include "scenes/lot/lot_layout.h"

namespace vcharge {

/// Fills the plan with bays, kerbs, plants, walls and furniture, all drawn from the seeds. Cars are left out.
LotLayout makeDrawnLot(const LotPlan& plan, uint64_t layout_seed, uint64_t seed);

}  // namespace vcharge
