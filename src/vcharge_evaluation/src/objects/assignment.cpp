#include "objects/assignment.h"

#include <limits>

namespace vcharge::internal {
namespace {

// A cost that no assignment contains, since each row can go without a column.
constexpr double kNever = 1e6;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Row 0 and column 0 stand for "none"; those of the costs begin at 1.
class ShortestPaths {
 public:
  explicit ShortestPaths(const Eigen::MatrixXd& costs)
      : costs_(costs),
        row_potential_(static_cast<size_t>(costs.rows()) + 1, 0.0),
        column_potential_(static_cast<size_t>(costs.cols()) + 1, 0.0),
        row_of_(static_cast<size_t>(costs.cols()) + 1, 0) {
    for (size_t row = 1; row <= static_cast<size_t>(costs.rows()); ++row) {
      addRow(row);
    }
  }
  // Row of each column.
  const std::vector<size_t>& rowOf() const { return row_of_; }

 private:
  // Finds the cheapest chain of columns by which all rows so far and this one have a column.
  void addRow(size_t row) {
    const size_t num_columns = row_of_.size();
    std::vector<double> slack(num_columns, kInfinity);
    std::vector<size_t> previous(num_columns, 0);
    std::vector<bool> visited(num_columns, false);
    row_of_[0] = row;
    size_t column = 0;
    do {
      visited[column] = true;
      const size_t from = row_of_[column];
      size_t next = 0;
      double least = kInfinity;
      for (size_t to = 1; to < num_columns; ++to) {
        if (visited[to]) {
          continue;
        }
        const double reduced =
            costs_(static_cast<Eigen::Index>(from) - 1, static_cast<Eigen::Index>(to) - 1) -
            row_potential_[from] - column_potential_[to];
        if (reduced < slack[to]) {
          slack[to] = reduced;
          previous[to] = column;
        }
        if (slack[to] < least) {
          least = slack[to];
          next = to;
        }
      }
      for (size_t each = 0; each < num_columns; ++each) {
        if (visited[each]) {
          row_potential_[row_of_[each]] += least;
          column_potential_[each] -= least;
        } else {
          slack[each] -= least;
        }
      }
      column = next;
    } while (row_of_[column] != 0);
    for (; column != 0; column = previous[column]) {
      row_of_[column] = row_of_[previous[column]];
    }
  }

  const Eigen::MatrixXd& costs_;
  std::vector<double> row_potential_, column_potential_;
  std::vector<size_t> row_of_;
};

}  // namespace

std::vector<std::optional<size_t>> assignLeastCost(const Eigen::MatrixXd& costs, double unassigned_cost) {
  const Eigen::Index num_rows = costs.rows(), num_columns = costs.cols();
  // Each row has a column of its own for "unassigned".
  Eigen::MatrixXd extended = Eigen::MatrixXd::Constant(num_rows, num_columns + num_rows, kNever);
  for (Eigen::Index row = 0; row < num_rows; ++row) {
    for (Eigen::Index column = 0; column < num_columns; ++column) {
      if (costs(row, column) <= unassigned_cost) {
        extended(row, column) = costs(row, column);
      }
    }
    extended(row, num_columns + row) = unassigned_cost;
  }
  std::vector<std::optional<size_t>> column_of(static_cast<size_t>(num_rows));
  const std::vector<size_t> row_of = ShortestPaths(extended).rowOf();
  for (size_t column = 1; column <= static_cast<size_t>(num_columns); ++column) {
    if (row_of[column] != 0) {
      column_of[row_of[column] - 1] = column - 1;
    }
  }
  return column_of;
}

}  // namespace vcharge::internal
