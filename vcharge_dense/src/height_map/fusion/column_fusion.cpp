#include "height_map/fusion/column_fusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <list>
#include <map>
#include <utility>

#include <tbb/parallel_for.h>

#include "height_map/fusion/column_optimum.h"
#include "height_map/fusion/weight_kernel.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kBlockCells = 512;          // side of a block of columns
constexpr size_t kViewsAtOnce = 8;        // views added to a block in one parallel loop
constexpr size_t kKeptBytes = 600000000;  // recently used views in memory
constexpr double kBytesPerCell = 94.0;    // images and solvers, see primal_dual.h
constexpr double kSupport_m = 0.1;        // counted around the best height for the supports
// Sum of weights, times the voxel height, at which the support reaches 1 - 1/e.
constexpr double kFullSupport_m = 0.05;
// A column is solid where a run of occupied voxels is this high: no camera sees free space above walls and
// pillars that reach out of the grid, so that they have no height.
constexpr double kMinSolidHeight_m = 0.5;

/// Keeps recently used views in memory.
class ViewCache {
 public:
  explicit ViewCache(LoadView load) : load_(std::move(load)) {}

  std::vector<std::shared_ptr<const PackedRangeMap>> get(const std::vector<size_t>& views) {
    std::vector<size_t> missing;
    for (const size_t view : views) {
      if (kept_.count(view) == 0) {
        missing.push_back(view);
      }
    }
    std::vector<std::shared_ptr<const PackedRangeMap>> loaded(missing.size());
    tbb::parallel_for(size_t{0}, missing.size(), [&](size_t i) { loaded[i] = load_(missing[i]); });
    for (size_t i = 0; i < missing.size(); ++i) {
      kept_bytes_ += bytesOf(*loaded[i]);
      kept_[missing[i]] = std::move(loaded[i]);
    }
    std::vector<std::shared_ptr<const PackedRangeMap>> maps;
    for (const size_t view : views) {
      maps.push_back(kept_.at(view));
      order_.remove(view);
      order_.push_back(view);
    }
    while (kept_bytes_ > kKeptBytes && order_.size() > views.size()) {
      kept_bytes_ -= bytesOf(*kept_.at(order_.front()));
      kept_.erase(order_.front());
      order_.pop_front();
    }
    return maps;
  }

 private:
  static size_t bytesOf(const PackedRangeMap& map) { return map.values.size() * sizeof(float); }

  const LoadView load_;
  std::map<size_t, std::shared_ptr<const PackedRangeMap>> kept_;
  size_t kept_bytes_ = 0;
  std::list<size_t> order_;  // least recently used first
};

/// Columns that are fused together, in cells of the grid.
struct Block {
  int first_column, first_row, columns, rows;
};

double distanceToBlock(const VoxelGrid& grid, const Block& block, const Eigen::Vector3d& position_m) {
  const Eigen::Vector2d low =
      grid.origin_m + grid.cell_size_m * Eigen::Vector2d(block.first_column, block.first_row);
  const Eigen::Vector2d high = low + grid.cell_size_m * Eigen::Vector2d(block.columns - 1, block.rows - 1);
  const Eigen::Vector2d position = position_m.head<2>();
  return (position - position.cwiseMax(low).cwiseMin(high)).norm();
}

struct Supports {
  double below, above;
};

/// Evidence for occupied space below a best height and free space above it.
Supports supportsOf(const float* weights, const VoxelGrid& grid, int height_index) {
  const int reach = std::max(1, static_cast<int>(std::lround(kSupport_m / grid.height_step_m)));
  double above = 0.0, below = 0.0, contrary = 0.0;
  for (int z = std::max(0, height_index - reach); z < std::min(grid.num_voxels, height_index + reach); ++z) {
    const double support = z < height_index ? weights[z] : -weights[z];
    (support < 0.0 ? contrary : z < height_index ? below : above) += std::abs(support);
  }
  const double total = above + below + contrary;
  const auto supportBy = [&](double weight) {
    return total > 0.0
               ? (above + below) / total * (1.0 - std::exp(-weight * grid.height_step_m / kFullSupport_m))
               : 0.0;
  };
  return {supportBy(below), supportBy(above)};
}

/// Fuses blocks one after the other.
class BlockFuser {
 public:
  BlockFuser(const VoxelGrid& grid, const HeightFusionOptions& options, ColumnImages* images)
      : grid_(grid),
        profile_(options),
        min_layer_weight_(options.min_layer_weight_m / grid.height_step_m),
        min_solid_voxels_(kMinSolidHeight_m / grid.height_step_m),
        padded_((grid.num_voxels + kVoxelLanes - 1) / kVoxelLanes * kVoxelLanes),
        kernel_(addColumnWeightsKernel()),
        images_(images),
        weights_(static_cast<size_t>(kBlockCells) * kBlockCells * padded_) {}

  void clear() { std::fill(weights_.begin(), weights_.end(), 0.0F); }

  void add(const Block& block, const std::vector<std::shared_ptr<const PackedRangeMap>>& maps) {
    tbb::parallel_for(0, block.rows, [&](int row) {
      for (const auto& map : maps) {
        addRow(block, row, *map);
      }
    });
  }

  void extract(const Block& block) {
    tbb::parallel_for(0, block.rows, [&](int row) {
      for (int column = 0; column < block.columns; ++column) {
        extractColumn(column, row, block.first_column + column, block.first_row + row);
      }
    });
  }

 private:
  float* columnWeights(int column, int row) {
    return weights_.data() + (static_cast<size_t>(row) * kBlockCells + column) * padded_;
  }

  void addRow(const Block& block, int row, const PackedRangeMap& map) {
    const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> rotation(map.rotation);
    const Eigen::Vector3f step = rotation.col(2) * static_cast<float>(grid_.height_step_m);
    const double bottom = grid_.bottom_m + 0.5 * grid_.height_step_m;
    const double reach2 = static_cast<double>(profile_.max_range_m) * profile_.max_range_m;
    for (int column = 0; column < block.columns; ++column) {
      const Eigen::Vector2d centre =
          grid_.origin_m +
          grid_.cell_size_m * Eigen::Vector2d(block.first_column + column, block.first_row + row);
      const Eigen::Vector3d offset(centre.x() - map.position_m.x(), centre.y() - map.position_m.y(),
                                   bottom - map.position_m.z());
      if (offset.head<2>().squaredNorm() > reach2) {
        continue;
      }
      const Eigen::Vector3f first = rotation * offset.cast<float>();
      kernel_(map, profile_,
              VoxelColumn{{first.x(), first.y(), first.z()}, {step.x(), step.y(), step.z()}, padded_},
              columnWeights(column, row));
    }
  }

  bool isSolid(const float* weights) const {
    const VoxelRun run = heaviestRun(weights, 0, grid_.num_voxels);
    return run.weight >= min_layer_weight_ && run.top - run.first >= min_solid_voxels_;
  }

  void extractColumn(int column, int row, int grid_column, int grid_row) {
    const float* weights = columnWeights(column, row);
    const ColumnOptimum best = findColumnOptimum(weights, grid_.num_voxels, min_layer_weight_);
    float& height = images_->best_height_m.at<float>(grid_row, grid_column);
    float& gain = images_->occupied_gain.at<float>(grid_row, grid_column);
    float& support_below = images_->support_below.at<float>(grid_row, grid_column);
    float& support_above = images_->support_above.at<float>(grid_row, grid_column);
    height = std::numeric_limits<float>::quiet_NaN();
    gain = static_cast<float>(best.occupied_cost - best.min_cost);
    support_below = support_above = 0.0F;
    images_->solid.at<uint8_t>(grid_row, grid_column) = isSolid(weights) ? 255 : 0;
    if (best.has_surface) {
      height = static_cast<float>(grid_.bottom_m + best.height_index * grid_.height_step_m);
      const Supports supports = supportsOf(weights, grid_, best.height_index);
      support_below = static_cast<float>(supports.below);
      support_above = static_cast<float>(supports.above);
    }
  }

  const VoxelGrid grid_;
  const WeightProfile profile_;
  const double min_layer_weight_, min_solid_voxels_;
  const int padded_;  // voxels per column, for the widest vectors
  const AddColumnWeights kernel_;
  ColumnImages* images_;
  std::vector<float> weights_;
};

std::vector<Block> blocksOf(const VoxelGrid& grid) {
  std::vector<Block> blocks;
  bool forwards = true;
  for (int row = 0; row < grid.rows; row += kBlockCells, forwards = !forwards) {
    std::vector<Block> line;
    for (int column = 0; column < grid.columns; column += kBlockCells) {
      line.push_back({column, row, std::min(kBlockCells, grid.columns - column),
                      std::min(kBlockCells, grid.rows - row)});
    }
    if (!forwards) {
      std::reverse(line.begin(), line.end());  // so that consecutive blocks need the same views
    }
    blocks.insert(blocks.end(), line.begin(), line.end());
  }
  return blocks;
}

}  // namespace

VoxelGrid makeVoxelGrid(const Eigen::AlignedBox3d& extent_m, const HeightFusionOptions& options) {
  check(!extent_m.isEmpty(), "makeVoxelGrid: expected views");
  const Eigen::Vector2d low = extent_m.min().head<2>(), high = extent_m.max().head<2>();
  const double cell = options.cell_size_m;
  const Eigen::Vector2d first = ((low.array() - options.max_range_m) / cell).floor();
  const Eigen::Vector2d last = ((high.array() + options.max_range_m) / cell).ceil();
  const double height = extent_m.sizes().z() + options.max_height_m - options.min_height_m;
  const double columns = last.x() - first.x() + 1.0, rows = last.y() - first.y() + 1.0;
  const double voxels = std::ceil(height / options.height_step_m);
  const double bytes =
      columns * rows * kBytesPerCell + 4.0 * kBlockCells * kBlockCells * (voxels + kVoxelLanes);
  if (!(bytes <= 1e9 * options.max_memory_gb)) {
    std::array<char, 320> text{};
    std::snprintf(
        text.data(), text.size(),
        "the grid of %.0f x %.0f cells of %g m, %.0f voxels high, would need %.1f GB, over max_memory_gb = "
        "%g: expected poses that lie closer together, larger cells or a larger limit",
        columns, rows, cell, voxels, 1e-9 * bytes, options.max_memory_gb);
    throw InputError(text.data());
  }
  VoxelGrid grid;
  grid.origin_m = cell * first;
  grid.cell_size_m = cell;
  grid.columns = static_cast<int>(columns);
  grid.rows = static_cast<int>(rows);
  grid.bottom_m = extent_m.min().z() + options.min_height_m;
  grid.height_step_m = options.height_step_m;
  grid.num_voxels = static_cast<int>(voxels);
  return grid;
}

ColumnImages fuseColumns(const VoxelGrid& grid, const std::vector<Eigen::Vector3d>& camera_positions_m,
                         const LoadView& load_view, const HeightFusionOptions& options,
                         const std::function<void(double)>& progress) {
  ColumnImages images;
  for (cv::Mat* image :
       {&images.best_height_m, &images.occupied_gain, &images.support_below, &images.support_above}) {
    image->create(grid.rows, grid.columns, CV_32FC1);
  }
  images.solid.create(grid.rows, grid.columns, CV_8UC1);
  BlockFuser fuser(grid, options, &images);
  ViewCache cache(load_view);
  const std::vector<Block> blocks = blocksOf(grid);
  for (size_t b = 0; b < blocks.size(); ++b) {
    std::vector<size_t> views;
    for (size_t view = 0; view < camera_positions_m.size(); ++view) {
      if (distanceToBlock(grid, blocks[b], camera_positions_m[view]) < options.max_range_m) {
        views.push_back(view);
      }
    }
    fuser.clear();
    for (size_t first = 0; first < views.size(); first += kViewsAtOnce) {
      const size_t last = std::min(views.size(), first + kViewsAtOnce);
      fuser.add(blocks[b], cache.get({views.begin() + static_cast<std::ptrdiff_t>(first),
                                      views.begin() + static_cast<std::ptrdiff_t>(last)}));
    }
    fuser.extract(blocks[b]);
    if (progress) {
      progress(static_cast<double>(b + 1) / static_cast<double>(blocks.size()));
    }
  }
  return images;
}

}  // namespace vcharge
