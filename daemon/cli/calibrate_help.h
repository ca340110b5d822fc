// What --help of the calibration verbs says below the options.
#pragma once

namespace zeropose::cli {

inline constexpr const char* calibrate_help =
    R"(Which method when:
             coplanar   non-coplanar  linear       vanishing    origin search  refinement
  estimates  f, K, pose all but the   fx fy cx cy, fx fy cx cy  cx cy          all
                        origin        pose
  needs      cx cy      cx cy         K = 0        K = 0        the others     start values
  object     one plane  with depth    with depth   rectangle    with depth     any
  accuracy   bad        good          ok           bad          very good      best
  robustness good       very good     good         ok           ok             good
calibrate points chooses by itself (--method auto): a linear method that suits the points, then the origin
search, then the refinement, then points that do not fit are thrown out.
  A board on the desk            one plane: turn it (views), or accept what one plane cannot tell
  Accurate guidance              points with depth over the whole image, all of the above: calibrate points
  Several boards or cameras      calibrate views
  A picture of a calibration body calibrate body
  Internals known, camera put up calibrate pose
  A robot in place of a board    calibrate tool, then calibrate ball
  A camera on or before a robot  calibrate hand-eye: a board seen at several poses of the hand
  A quick look                   a rectangle on the wall from four sides: calibrate vanishing
Every result comes with standard deviations, a verdict in words and, with --report, a page with the plots:
docs/calibration.md says how to read it. Nothing is activated by calibrating.
Example:
  zeropose calibrate points --points points.csv --width 768 --height 572 --report page.svg)";

inline constexpr const char* calibrate_points_help =
    R"(points.csv: columns x_mm y_mm z_mm u_px v_px, optional suu svv suv (covariance of the pixel, px^2) and
radius_mm nx ny nz (a flat disc: its image's centre is not the image of its centre).
--method: the linear method that begins; auto takes coplanar or noncoplanar, as the points lie. --refine none
stops after it and after the origin search.
--fix holds parameters at the values of --start: fx fy cx cy K k1 k2 p1 p2 k3 x y z rx ry rz, or pose, origin,
focal, distortion for all of a kind. An origin without --start is held at --origin or the image centre.
--sigma-px is the noise of one pixel coordinate: with it the verdict can judge the fit; without it the sigmas
come from the residuals.
Angles in JSON and files are degrees; sigma and correlation belong to the six numbers of X_WC.
--frame-offset-z-mm moves the camera's frame in the answer along its z axis, for exchange with systems that put
it on the chip or the housing. Such a pose must not be used for measuring and is never saved with --output.
Examples:
  zeropose calibrate points --points p.csv --width 768 --height 572 --sigma-px 0.1 --pitch-mm 0.008325 \
      --report page.svg --output camera.json
  zeropose calibrate points --points p.csv --start camera.json --fix fx,fy,cx,cy,K --json
Exit status: 0 done, 1 the points cannot give an answer (status and reason say why), 2 wrong usage or
unreadable input.)";

inline constexpr const char* calibrate_vanishing_help =
    R"(A rectangle or square of unknown place, seen from several sides; no distortion (convert the picture before, or
take a long lens). Pairs: columns v1_u_px v1_v_px v2_u_px v2_v_px, the vanishing points of two perpendicular
directions per image. Corners: columns image corner u_px v_px with corner 1..4 in the order A B C D around the
rectangle; x runs along AB (side L), y along AD (k times L).
4 images and more give fx fy cx cy; 3 (or --one-focal) fx = fy, cx cy; with --origin 2 images give fx fy and one
gives fx = fy; with --focal 2 images and more give cx cy (of two possible ones the nearer to --near).
Skipped with a warning: images in which two sides are parallel (--square: the diagonals step in), poses parallel
to an earlier one, vanishing points farther than --max-px from pixel (0, 0). That limit is off by default.
Turn the camera about different axes: images from similar poses say the same.
Examples:
  zeropose calibrate vanishing --pairs pairs.csv --first 10 --json
  zeropose calibrate vanishing --corners corners.csv --ratio 1 --side-mm 200 --square --width 768 --height 572
Exit status: 0 done, 1 the images do not determine the camera, 2 wrong usage or unreadable input.)";

}  // namespace zeropose::cli
