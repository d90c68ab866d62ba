#pragma once

#include "kernels/sweep_kernels.h"

namespace vcharge {

// Each function sets the kernels of its file.
void addWarpKernels(SweepKernels* kernels);
void addCorrelationKernels(SweepKernels* kernels);
void addVoteKernels(SweepKernels* kernels);
void addUncertaintyKernels(SweepKernels* kernels);

}  // namespace vcharge
