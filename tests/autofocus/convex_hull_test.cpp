// The nearest point between others, held against mixtures that are drawn and against what makes a point the nearest.
#include "autofocus/algebra/convex_hull.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lensd::autofocus {
namespace {

using Places = std::vector<std::vector<double>>;

Places Drawn(std::mt19937_64& random, std::size_t count, std::size_t coordinates, double flatness) {
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  Places places(count, std::vector<double>(coordinates));
  for (auto& place : places) {
    for (double& value : place) value = within(random);
    place.back() *= flatness;
  }
  return places;
}

double Squares(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

TEST(ConvexHull, WhatLiesBetweenIsItsOwnNearest) {
  std::mt19937_64 random(5);
  std::exponential_distribution<double> share;
  int inside = 0;
  for (const double flatness : {1.0, 1e-2, 1e-4}) {
    for (std::size_t coordinates = 1; coordinates <= 4; ++coordinates) {
      for (std::size_t count = 1; count <= 12; ++count) {
        for (int draw = 0; draw < 100; ++draw) {
          const Places places = Drawn(random, count, coordinates, flatness);
          std::vector<double> at(coordinates), shares(count);
          double sum = 0.0;
          for (double& part : shares) sum += part = share(random) * share(random);
          for (std::size_t k = 0; k < count; ++k) {
            for (std::size_t i = 0; i < coordinates; ++i) at[i] += shares[k] / sum * places[k][i];
          }
          const bool same = NearestBetween(places, at) == at;
          inside += same;
          EXPECT_TRUE(same) << flatness << ' ' << coordinates << ' ' << count << ' ' << draw;
        }
      }
    }
  }
  EXPECT_EQ(inside, 14400);
}

TEST(ConvexHull, OfOtherPlacesNoneBetweenIsNearer) {
  std::mt19937_64 random(6);
  int outside = 0;
  for (std::size_t coordinates = 1; coordinates <= 4; ++coordinates) {
    for (std::size_t count = 1; count <= 12; ++count) {
      for (int draw = 0; draw < 100; ++draw) {
        const Places places = Drawn(random, count, coordinates, 1.0);
        const std::vector<double> at = Drawn(random, 1, coordinates, 1.0)[0];
        const std::vector<double> nearest = NearestBetween(places, at);
        if (nearest == at) continue;
        ++outside;
        const double distance = std::sqrt(Squares(nearest, at));
        for (const auto& place : places) {
          double beyond = 0.0;  // how far the place lies on the point's side of the plane through the nearest
          for (std::size_t i = 0; i < coordinates; ++i) beyond += (place[i] - nearest[i]) * (at[i] - nearest[i]);
          EXPECT_LT(beyond / distance, 1e-6) << coordinates << ' ' << count << ' ' << draw;
        }
        // It is between them itself.
        EXPECT_LT(Squares(NearestBetween(places, nearest), nearest), 1e-11);
      }
    }
  }
  EXPECT_GT(outside, 1000);
}

/// A place that was refused, and told to be nearest to itself.
TEST(ConvexHull, AThinOneHoldsWhatLiesInIt) {
  const Places places = {{-0.97922, -0.0925963, -0.56645},
                         {-0.440641, -0.0273229, 0.486917},
                         {-0.177639, -0.9175, -0.131675},
                         {-0.883336, -0.187426, -0.584307},
                         {-0.838627, -0.182288, -0.377178}};
  const std::vector<double> at = {-0.787294, -0.237103, -0.380291};
  EXPECT_EQ(NearestBetween(places, at), at);
}

}  // namespace
}  // namespace lensd::autofocus
