#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_evaluation/error_distribution.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge {

/// Options of ObstacleMapEvaluator.
struct ObstacleMapEvaluationOptions {
  VCHARGE_BEGIN_OPTIONS(ObstacleMapEvaluationOptions);
  VCHARGE_OPTION(double, min_height_m, 0.3, positive(), "Least height of an obstacle that must be reported.");
  VCHARGE_OPTION(double, corridor_m, 4.0, positive(),
                 "Distance of such an obstacle from the ground driven over.");
  VCHARGE_OPTION(double, view_range_m, 5.0, positive(), "Distance at which an obstacle is first visible.");
  VCHARGE_END_OPTIONS();
};

/// An obstacle that was visible and could be judged.
struct ObstacleOutcome {
  std::string kind;
  Eigen::Vector2d middle_m{0.0, 0.0};  ///< centre in the world
  double height_m = 0.0;
  double width_m = 0.0;
  double distance_m = 0.0;  ///< distance from the ground driven over
  bool reported = false;    ///< whether it was reported when due, 1 m of travel after it was first visible
  size_t frames = 0;        ///< maps since then in which it was visible
  size_t frames_reported = 0;
};

/// A cell that was occupied on open ground at any time. Each cell counts once.
struct FalseCell {
  Eigen::Vector2d world_m{0.0, 0.0};  ///< position when it was first occupied
  Timestamp first_seen;
  size_t frames = 0;        ///< number of maps in which it was occupied
  bool is_left = false;     ///< still occupied when the vehicle had passed
  bool is_on_open = false;  ///< the ground there was visible to a camera at some time
};

/// A point on the outline of a kerb that was visible and could be judged.
struct KerbOutcome {
  Eigen::Vector2d position_m{0.0, 0.0};  ///< in the world
  double nearest_m = 0.0;       ///< least distance of the vehicle's middle since the point was first visible
  bool reported = false;        ///< whether it was reported when due
  bool ever_reported = false;   ///< whether it was reported at any time within the view range
  double height_error_m = 0.0;  ///< absolute error when due
};

/// Images in which moving objects of one kind were visible, and those in which they were reported.
struct MoverCounts {
  size_t frames = 0;
  size_t frames_reported = 0;
};

struct ObstacleMapErrors {
  size_t num_frames = 0;
  double driven_m = 0.0;
  std::vector<ObstacleOutcome> obstacles;
  std::vector<FalseCell> false_cells;  ///< all false cells; the numbers below count those on open ground
  size_t num_false_cells = 0;          ///< number over the whole drive
  double false_cells_per_10_m = 0.0;
  size_t num_false_left = 0;         ///< cells still occupied when the vehicle had passed
  size_t num_false_hidden = 0;       ///< cells on ground that was never visible
  double false_cells_per_map = 0.0;  ///< mean number per map
  size_t num_observed_inside = 0;    ///< cells inside true obstacles that were ever observed
  size_t num_free_inside = 0;        ///< those that were ever free
  size_t num_kerb_points = 0;        ///< visible points on outlines of kerbs, every 10 cm
  size_t num_kerb_reported = 0;
  ErrorDistribution kerb_height_error_m;      ///< absolute errors of the reported points
  std::vector<KerbOutcome> kerbs;             ///< all judged points
  std::map<std::string, MoverCounts> movers;  ///< by kind
  size_t num_mover_cells = 0;                 ///< cells under moving objects, over all these images
  size_t num_mover_free = 0;                  ///< those that were free
};

/// Compares the fused maps of one drive, in order of time, with the surfaces visible at the same time.
class ObstacleMapEvaluator {
 public:
  /// path: the vehicle's true poses over the whole drive. The scene's ground must be level at z = 0.
  ObstacleMapEvaluator(const std::vector<TruthObstacle>& obstacles, const TruthHeights& heights,
                       const std::vector<RigidTransform>& path,
                       const ObstacleMapEvaluationOptions& options = {});

  /// movers: moving objects at this time; earlier_movers: those of the last second.
  void add(const ObstacleMap& map, const std::vector<SeenPoint>& points,
           const RigidTransform& world_from_vehicle, const std::vector<TruthObstacle>& movers,
           const std::vector<TruthObstacle>& earlier_movers);

  ObstacleMapErrors errors() const;

 private:
  struct Tracked {
    TruthObstacle obstacle;
    std::optional<double> first_view_m;  // distance driven when it was first visible
    bool judged = false;
    ObstacleOutcome outcome;
  };
  struct KerbPoint {
    double height_m = 0.0;
    std::optional<double> first_view_m;
    bool judged = false;
    KerbOutcome outcome;
  };
  struct Frame;

  void addKerbPoints(const TruthObstacle& kerb, const cv::Mat& highest_m,
                     const std::vector<RigidTransform>& path);
  void judgeObstacles(const Frame& frame);
  void judgeKerbs(const Frame& frame);
  static std::optional<double> kerbHeightError(const Frame& frame, const KerbPoint& point);
  void judgeCells(const Frame& frame);
  void addFalseCellsTo(ObstacleMapErrors* errors) const;
  void judgeMovers(const Frame& frame);

  ObstacleMapEvaluationOptions options_;
  TruthHeights heights_;
  cv::Mat highest_around_, lowest_around_;
  std::vector<TruthObstacle> standing_;
  std::vector<Tracked> tracked_;
  std::vector<KerbPoint> kerb_points_;
  std::map<int64_t, FalseCell> false_cells_;  // key: cell of the map's fixed frame
  SeenCells seen_ground_;
  std::set<int64_t> observed_inside_, free_inside_;
  std::optional<Eigen::Vector2d> last_position_m_;
  ObstacleMapErrors sums_;  // totals of maps, travel and moving objects; the other members are not set
};

}  // namespace vcharge
