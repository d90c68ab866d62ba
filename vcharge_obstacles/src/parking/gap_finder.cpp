#include "vcharge_obstacles/gap_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "parking/area_of_map.h"

namespace vcharge {
namespace {

constexpr double kBack_m = 9.0, kAhead_m = 6.0;  // limits of the search, from the rear axle
constexpr double kBeside_m = 0.1;                // from the vehicle's side to the first place looked at
constexpr double kReach_m = 7.0;                 // from the vehicle's side
constexpr double kMaxFlank_m = 4.5;    // from the vehicle's side to the nearest sides of parked cars
constexpr double kDoor_m = 0.35;       // to open a door on one side
constexpr double kMargin_m = 0.2;      // in depth
constexpr double kLane_m = 5.0;        // width from which a deep gap may be a lane
constexpr double kUnknownRun_m = 0.2;  // in depth, between free places
constexpr double kHiddenEnd_m = 0.6;   // ground next to the things at the ends, which may be unknown
constexpr double kLeastSigma_m = 0.03;

/// What lies beside the vehicle at one distance along its axis. Distances are from the side of the vehicle.
struct Column {
  double free_to_m = 0.0;  ///< all is free from the vehicle on; unknown places only count between free ones
  /// The first thing that stands there; infinity if there is none.
  double blocked_m = std::numeric_limits<double>::infinity();
};

/// One side of the vehicle. x runs along the vehicle's axis, out_m away from its side.
class Side {
 public:
  Side(const ObstacleMap& map, double sign, double half_width_m)
      : map_(map), sign_(sign), half_width_m_(half_width_m) {
    const Eigen::Vector3d axis = map.fixed_from_vehicle.rotation() * Eigen::Vector3d::UnitX();
    along_ = axis.head<2>().normalized();
    out_ = sign * Eigen::Vector2d(-along_.y(), along_.x());
    origin_m_ = map.fixed_from_vehicle.translation().head<2>();
    const int count = static_cast<int>((kBack_m + kAhead_m) / map.cell_size_m);
    for (int i = 0; i < count; ++i) {
      columns_.push_back(columnAt(xOf(i)));
    }
  }

  int numColumns() const { return static_cast<int>(columns_.size()); }
  const Column& column(int i) const { return columns_[static_cast<size_t>(i)]; }
  double xOf(int i) const { return -kBack_m + (i + 0.5) * map_.cell_size_m; }
  double cellSize_m() const { return map_.cell_size_m; }

  Eigen::Vector2d fixed(double x_m, double out_m) const {
    return origin_m_ + x_m * along_ + (half_width_m_ + out_m) * out_;
  }

  /// Corners of a rectangle, counter-clockwise from above, those nearest to the vehicle first.
  Quadrangle rectangle(double from_x_m, double to_x_m, double from_out_m, double to_out_m) const {
    const double first_x_m = sign_ > 0.0 ? from_x_m : to_x_m, second_x_m = sign_ > 0.0 ? to_x_m : from_x_m;
    return {fixed(first_x_m, from_out_m), fixed(second_x_m, from_out_m), fixed(second_x_m, to_out_m),
            fixed(first_x_m, to_out_m)};
  }

  /// The obstacle in a rectangle that is farthest ahead (or with is_first, farthest back).
  struct End {
    double x_m, sigma_m;
  };
  std::optional<End> endIn(double from_x_m, double to_x_m, double from_out_m, double to_out_m,
                           bool is_first) const {
    std::optional<End> best;
    const AreaCells cells = cellsOf(map_, rectangle(from_x_m, to_x_m, from_out_m, to_out_m));
    for (int row = 0; row < cells.box.height; ++row) {
      for (int column = 0; column < cells.box.width; ++column) {
        const cv::Point cell(cells.box.x + column, cells.box.y + row);
        if (cells.inside.at<uint8_t>(row, column) == 0 || map_.state.at<int8_t>(cell) != kCellOccupied) {
          continue;
        }
        const auto point = map_.point_m.at<cv::Vec2f>(cell);
        const float sigma_m = map_.point_sigma_m.at<float>(cell);
        const bool is_measured = std::isfinite(point[0]) && std::isfinite(point[1]);
        const Eigen::Vector2d at_m =
            map_.origin_m + (is_measured ? Eigen::Vector2d(point[0], point[1])
                                         : Eigen::Vector2d((cell.x + 0.5) * map_.cell_size_m,
                                                           (cell.y + 0.5) * map_.cell_size_m));
        const double x_m = along_.dot(at_m - origin_m_);
        if (!best || (is_first ? x_m < best->x_m : x_m > best->x_m)) {
          best = End{x_m, std::isfinite(sigma_m) ? sigma_m : map_.cell_size_m};
        }
      }
    }
    return best;
  }

 private:
  int8_t stateAt(double x_m, double out_m) const {
    const Eigen::Vector2d cell = (fixed(x_m, out_m) - map_.origin_m) / map_.cell_size_m;
    const cv::Point at(static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y())));
    return cv::Rect({0, 0}, map_.state.size()).contains(at) ? map_.state.at<int8_t>(at) : kCellUnobserved;
  }

  Column columnAt(double x_m) const {
    Column column;
    const int unknown_run = static_cast<int>(std::lround(kUnknownRun_m / map_.cell_size_m));
    int num_unknown = 0;
    bool is_open = true;
    for (double out_m = kBeside_m; out_m < kReach_m; out_m += map_.cell_size_m) {
      const int8_t state = stateAt(x_m, out_m);
      if (state == kCellOccupied) {
        column.blocked_m = out_m;
        break;
      }
      num_unknown = state == kCellFree ? 0 : num_unknown + 1;
      is_open = is_open && num_unknown <= unknown_run;
      if (is_open && state == kCellFree) {
        column.free_to_m = out_m + 0.5 * map_.cell_size_m;
      }
    }
    return column;
  }

  const ObstacleMap& map_;
  const double sign_, half_width_m_;
  Eigen::Vector2d along_, out_, origin_m_;
  std::vector<Column> columns_;
};

/// Makes the gap between the columns `last` (of a thing behind) and `next` (of a thing ahead), if it is one.
std::optional<ParkingGap> gapBetween(const Side& side, int last, int next, const VehicleFootprint& vehicle) {
  const int hidden = static_cast<int>(std::lround(kHiddenEnd_m / side.cellSize_m()));
  const double flank_m = std::min(side.column(last).blocked_m, side.column(next).blocked_m);
  std::vector<double> depths_m;
  int num_closed = 0;
  for (int i = last + 1; i < next; ++i) {
    const Column& column = side.column(i);
    if (column.free_to_m <= flank_m && i > last + hidden && i < next - hidden) {
      return std::nullopt;  // unknown ground
    }
    if (column.free_to_m > flank_m) {
      depths_m.push_back(column.free_to_m - flank_m);
      num_closed += column.blocked_m < kReach_m ? 1 : 0;
    }
  }
  if (depths_m.empty()) {
    return std::nullopt;
  }
  // Ground at the ends is often hidden; anywhere else, the shallowest place counts.
  const auto inner_begin = depths_m.begin() + std::min<std::ptrdiff_t>(hidden, (depths_m.size() - 1) / 2);
  const auto inner_end = depths_m.end() - std::min<std::ptrdiff_t>(hidden, (depths_m.size() - 1) / 2);
  ParkingGap gap;
  gap.depth_m = *std::min_element(inner_begin, inner_end);
  const bool is_deep = gap.depth_m >= vehicle.length_m + kMargin_m;
  gap.kind = is_deep ? BayKind::kPerpendicular : BayKind::kParallel;
  const double needed_m = is_deep ? vehicle.length_m + kMargin_m : vehicle.width_m + kMargin_m;
  if (gap.depth_m < needed_m) {
    return std::nullopt;
  }
  const double begin_m = side.xOf(last), end_m = side.xOf(next), near_m = flank_m - side.cellSize_m();
  const auto behind = side.endIn(begin_m - 1.5, 0.5 * (begin_m + end_m), near_m, flank_m + needed_m, false);
  const auto ahead = side.endIn(0.5 * (begin_m + end_m), end_m + 1.5, near_m, flank_m + needed_m, true);
  if (!behind || !ahead) {
    return std::nullopt;
  }
  gap.length_m = ahead->x_m - behind->x_m;
  gap.length_sigma_m = std::max(kLeastSigma_m, std::hypot(behind->sigma_m, ahead->sigma_m));
  const bool is_gap = is_deep ? gap.length_m >= vehicle.width_m + 2.0 * kDoor_m && gap.length_m < kLane_m
                              : gap.length_m >= vehicle.minParallelGap_m() &&
                                    2 * num_closed >= static_cast<int>(depths_m.size());
  gap.corners_m = side.rectangle(behind->x_m, ahead->x_m, flank_m, flank_m + gap.depth_m);
  return is_gap ? std::optional(gap) : std::nullopt;
}

}  // namespace

GapFinder::GapFinder(const VehicleFootprint& vehicle) : vehicle_((vehicle.validate(), vehicle)) {}

std::vector<ParkingGap> GapFinder::find(const ObstacleMap& map) const {
  std::vector<ParkingGap> gaps;
  for (const double sign : {1.0, -1.0}) {
    const Side side(map, sign, vehicle_.outline().half_width_m);
    for (int last = 0; last < side.numColumns(); ++last) {
      // The side of something, next to which what closes the gap stands back by the width of the vehicle.
      const double back_m = side.column(last).blocked_m + vehicle_.width_m + kMargin_m;
      int next = last + 1;
      while (next < side.numColumns() && side.column(next).blocked_m >= back_m) {
        ++next;
      }
      if (side.column(last).blocked_m > kMaxFlank_m || next == last + 1 || next == side.numColumns()) {
        continue;
      }
      if (const auto gap = gapBetween(side, last, next, vehicle_)) {
        gaps.push_back(*gap);
      }
      last = next - 1;
    }
  }
  return gaps;
}

}  // namespace vcharge
