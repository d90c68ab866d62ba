#include "extraction/even_selection.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace vcharge {

std::vector<int> selectEvenly(const std::vector<SelectionCandidate>& candidates, cv::Size size,
                              int grid_columns, int grid_rows, int max_count) {
  std::vector<int> selected(candidates.size());
  std::iota(selected.begin(), selected.end(), 0);
  if (static_cast<int>(candidates.size()) <= max_count) {
    return selected;
  }
  const auto better = [&](int a, int b) {
    const float response_a = candidates[a].response;
    const float response_b = candidates[b].response;
    return response_a != response_b ? response_a > response_b : a < b;
  };
  std::vector<std::vector<int>> cells(static_cast<size_t>(grid_columns) * grid_rows);
  for (size_t i = 0; i < candidates.size(); ++i) {
    const cv::Point2f& p = candidates[i].position_px;
    const int column = std::clamp(static_cast<int>(p.x * grid_columns / size.width), 0, grid_columns - 1);
    const int row = std::clamp(static_cast<int>(p.y * grid_rows / size.height), 0, grid_rows - 1);
    cells[static_cast<size_t>(row) * grid_columns + column].push_back(static_cast<int>(i));
  }
  // The number of complete rounds follows from the sizes of the cells, so only the selected candidates need
  // to be sorted.
  size_t turns = 0;
  const auto takenAfter = [&](size_t count) {
    size_t taken = 0;
    for (const auto& cell : cells) {
      taken += std::min(cell.size(), count);
    }
    return taken;
  };
  while (takenAfter(turns + 1) <= static_cast<size_t>(max_count)) {
    ++turns;
  }
  selected.clear();
  std::vector<int> last_turn;
  for (auto& cell : cells) {
    const size_t taken = std::min(cell.size(), turns);
    const size_t sorted = std::min(cell.size(), turns + 1);
    std::partial_sort(cell.begin(), cell.begin() + static_cast<std::ptrdiff_t>(sorted), cell.end(), better);
    selected.insert(selected.end(), cell.begin(), cell.begin() + static_cast<std::ptrdiff_t>(taken));
    if (sorted > taken) {
      last_turn.push_back(cell[taken]);
    }
  }
  std::sort(last_turn.begin(), last_turn.end(), better);
  last_turn.resize(std::min(last_turn.size(), static_cast<size_t>(max_count) - selected.size()));
  selected.insert(selected.end(), last_turn.begin(), last_turn.end());
  std::sort(selected.begin(), selected.end());
  return selected;
}

}  // namespace vcharge
