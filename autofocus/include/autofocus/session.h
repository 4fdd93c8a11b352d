// One autofocus run of any method, with what every run owes its user: the frame before it began is the standard to
// beat, the answer is checked with a frame taken there, and an answer that does not hold is a refusal.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "autofocus/method.h"
#include "autofocus/peak_fit.h"
#include "autofocus/sharpness.h"
#include "base/result.h"

namespace lensd::autofocus {

/// The names Session::Create() knows.
std::vector<std::string_view> MethodNames();

/// Pixels of a region of a frame, cut to the frame. InvalidArgument: outside it, or smaller than 16 x 16 px.
Result<Window> WindowOf(const drivers::Region& region, int width, int height);

/// Where the lens was during a frame.
struct Place {
  Place(double where) : position(where) {}  // NOLINT(google-explicit-constructor): it stood there
  Place(double where, double uncertain) : position(where), sigma(uncertain), on_the_way(true) {}
  double position = 0.0;    ///< at mid-exposure
  double sigma = 0.0;       ///< standard deviation of that
  bool on_the_way = false;  ///< it moved meanwhile
};

class FixedPattern;
class SharpnessCurve;

class Session {
 public:
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  /// InvalidArgument: no such method, or one that needs pictures where there are none. Unsupported: one that looks
  /// while moving, with a lens that cannot.
  static Result<Session> Create(std::string_view method, const Setup& setup);

  /// Takes the first frame, then each frame asked for, with the position it was taken at. A focused verdict has been
  /// checked: the lens stands at its position. After a verdict the session is over.
  /// InvalidArgument: the window does not fit the frame.
  Result<Advice> Next(const Place& place, const drivers::Frame& frame, const drivers::Region& region);

  /// The same for a sharpness that a client measured: any value that rises with focus, > 0, and its standard
  /// deviation from frame to frame, > 0.
  Advice NextScore(double position, const Sharpness& sharpness);

  /// The method that is running: "auto" names the one it has come to.
  std::string_view method() const { return names_[running_]; }
  /// Frames taken so far, and how many it will be in all as far as can be told.
  int frames() const;
  int frames_expected() const;
  /// Sharpness of the last frame relative to the first: gradient energy free of noise and brightness.
  double relative_sharpness() const;
  /// All frames in the order they were taken, as comparable as they are by now: a later frame may show that a part of
  /// the window has to be left out of all of them.
  std::vector<CurvePoint> Curve() const;

 private:
  Session(const Setup& setup, std::vector<std::string_view> names);
  void StartMethod();
  static bool Refused(const Advice& advice);
  Advice Follow(const Look& look);
  Advice Ask(const Look& look);
  Advice Proved(Advice advice, double stands);
  void TellEarlier(Verdict& verdict) const;
  bool TakeOutWhatStays(Cause cause);
  Advice FromTheStart();
  void PutInOrder(const Look& first);
  Advice Prove(double stands);
  std::optional<double> SideToSee(double answer) const;
  std::optional<double> FartherSide() const;
  std::optional<double> SharperBeside() const;
  Verdict Check() const;
  bool MayRepeat(const CurvePoint& answer) const;

  Setup setup_;
  std::vector<std::string_view> names_;  ///< to be tried in this order
  std::string forecast_;                 ///< why in this order
  std::size_t running_ = 0;
  std::unique_ptr<Method> method_;
  int frames_before_ = 0;                  ///< it began
  std::unique_ptr<SharpnessCurve> curve_;  ///< of all frames
  std::unique_ptr<FixedPattern> stays_;    ///< taken out of them where a sweep found nothing
  struct Sent {
    drivers::Frame frame;
    double position = 0.0;
    Window window;
  };
  std::optional<Sent> last_;
  bool repeated_ = false;  ///< one frame was the one before, though the lens had moved
  /// An answer under proof.
  struct Proof {
    Verdict verdict;
    bool sent = false;  ///< the lens has been sent to it
    int moves_on = 0;   ///< from it to sharper frames beside it
  };
  std::optional<Proof> proof_;
  std::optional<Verdict> earlier_;  ///< what the method before this one refused with
};

}  // namespace lensd::autofocus
