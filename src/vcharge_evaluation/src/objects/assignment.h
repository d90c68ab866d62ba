#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace vcharge::internal {

/// Assigns rows to columns one to one such that the sum of costs is least, where a row without a column costs
/// `unassigned_cost` and a pair that costs more than this is never assigned. For each row its column. Costs
/// are finite and not negative. Hungarian method: Kuhn, "The Hungarian method for the assignment problem",
/// Naval Research Logistics 1955, with shortest augmenting paths.
std::vector<std::optional<size_t>> assignLeastCost(const Eigen::MatrixXd& costs, double unassigned_cost);

}  // namespace vcharge::internal
