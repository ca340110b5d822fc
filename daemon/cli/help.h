// What --help of the batch verbs says below the options.
#pragma once

namespace zeropose::cli {

inline constexpr const char* check_config_help =
    R"(Prints a summary, or every mistake at once, each with file, line or key path, what was found and what is
expected.
Example:
  zeropose check-config config/cells/car-body.json
Exit status: 0 all is well, 2 mistakes or an unreadable file.)";

inline constexpr const char* bestfit_help =
    R"(X_AB carries points given in frame B onto the same points given in frame A with the least weighted sum of
squared distances. Needs three points that are not on a line.
Example: points.csv
  xa, ya, za, xb, yb, zb
  0, 0, 0, 10, 0, 0
  100, 0, 0, 10, 100, 0
  0, 50, 0, -40, 0, 0
  zeropose bestfit --points points.csv
Exit status: 0 done, 1 too few or collinear points, 2 wrong usage or unreadable input.)";

inline constexpr const char* convert_pose_help =
    R"(Each maker's numbers are in its order and units: mm and degrees; universal-robots m and a rotation vector in
rad; abb mm and a quaternion w x y z; matrix 16 numbers row by row, mm. Conventions: zeropose (the same as
generic: x y z rx ry rz with R = Rz Ry Rx), kuka, fanuc, yaskawa, mitsubishi, epson, kawasaki, comau, staubli,
abb, universal-robots, denso, techman, adept, doosan, matrix.
Without VALUES one pose per line is read from stdin; lines that begin with # are comments.
Write -0.5, not -.5, or put -- in front of the values.
Examples:
  zeropose convert pose --from kuka --to abb 100 200 -300 90 0 10
  zeropose convert pose --from zeropose --to fanuc --json < poses.csv
Exit status: 0 done, 1 the numbers are no rotation, 2 wrong usage or unreadable input.)";

inline constexpr const char* convert_camera_help =
    R"(OpenCV: the YAML that cv::FileStorage and OpenCV's calibration samples write. ROS: camera_info YAML as
camera_calibration writes it. zeropose: {"model": "division", ...}, or cameras by name. Pixel (0, 0) is the
centre of the top-left pixel in all of them.
OpenCV and ROS know the brown model (k1 k2 p1 p2 k3) only. A division model is replaced by the brown model that
is nearest over the image; what that costs in px is said, and refused above --max-residual-px. Fisheye,
rational and tilted models are refused. Their files have no pose.
Examples:
  zeropose convert camera --from opencv --to zeropose camera.yml --output camera.json
  zeropose convert camera --from zeropose --to ros --name left cameras.json > left.yaml
Exit status: 0 done, 1 the lens model cannot be converted, 2 wrong usage or unreadable input.)";

inline constexpr const char* pose_help =
    R"(Marks that do not fit the others are removed and named; when the redundancy does not tell which one is wrong,
there is no answer. When several poses explain the marks equally well (three marks in one camera: up to four)
there is none either, but the JSON lists them all as alternatives, best first. suu svv suv is the covariance of the found pixel in px^2. Where it is not given it is that
of one pixel (1 1 0): without wrong marks the pose is the same, but its covariance and the test for wrong
marks then speak of one pixel. The covariance of the pose is along and about the world's axes, about the
object's origin.
Example:
  zeropose pose --cameras cameras.json --marks marks.csv --observations found.csv --json
with cameras.json
  {"left": {"model": "division", "width": 768, "height": 572, "fx": 4235, "fy": 4228, "cx": 416, "cy": 333,
            "K": -0.01, "X_WC": [-1884, -3063, -939, -69.2, -3, -35.4]}, ...}
marks.csv                     found.csv
  mark, x_mm, y_mm, z_mm        camera, mark, u_px, v_px
  hole, -525.6, -751.9, 200.9   left, hole, 401.25, 288.5
Exit status: 0 done, 1 no answer (status, code and reason say why), 2 wrong usage or unreadable input.)";

inline constexpr const char* find_board_help =
    R"(Circles are measured to hundredths of a pixel, dark on light or light on dark; the board may be tilted by up to
70 degrees, turned, unevenly lit and partly covered. Chessboards are given by their inner corners (one less than
the squares, both ways) and must be seen as a whole.
The board's frame: x along the columns, y along the rows, z away from the camera; row 0, column 0 is its origin.
asymmetric-circles as in OpenCV: x = (2 col + row % 2) pitch, y = row pitch, so that neighbours in a row are two
pitches apart. A symmetric board looks the same after half a turn (square: a quarter turn); then the origin is the
corner nearest to the image's top left. equivalent_readings says how many there are. Where the board's frame must
be the same in several images (linear stage, hand-eye, several cameras), use an asymmetric board with an odd number
of rows, or do not turn the board.
Hidden circles are listed in missing. When an outer row or column is hidden as a whole, nothing tells which part of
the board is seen: no answer, unless --partial says that any part will do: then rows and columns are counted from
the first one found. That suits views with unknown poses of the board and nothing else.
u_px v_px is the centre of a circle's image, which is not the image of its centre when the board is tilted: give
--diameter-mm, and the CSV gets the column radius_mm from which the calibration corrects this.
Example: all there is for one view
  zeropose find-board --image view1.png --rows 11 --cols 11 --pitch-mm 10 --diameter-mm 5 --csv view1.csv
Exit status: 0 done, 1 no board found (with the reason), 2 wrong usage or unreadable input.)";

inline constexpr const char* find_help =
    R"(All marks of the kind in the window (without --window in the whole picture), the highest contrast first; of a
template only the best one. Pixel
(0, 0) is the centre of the top-left pixel; suu svv suv is the covariance of the place in px^2. Kinds:
  circle    flat disc or hole, --bright or --dark (default): centre of its ellipse
  ring      circles about one centre: --inner 0.6 or --inner 0.7,0.35 are the inner ones' radii by the outer one's
  ball      a sphere's outline
  slot      a long hole; --direction: its longer axis
  cross     two bars; --direction: one of them, --opening: the angle between them
  corner    two edges; --direction: the middle of the angle, into the mark, --opening: the angle
  edge      a straight edge; --direction: across it, from dark to bright; needs a --window
  template  what --template T.png shows, with --click U,V the point in it (default its middle), turned by at most
            5 degrees or the --direction-tolerance given; needs a --window
Angles in degrees, from right to down. Sizes are those of the longer axis; a cross's span, an edge's and a corner's
visible length. Where nothing is found the reason says which limit was missed by which number.
Examples:
  zeropose find --image car.png --min-diameter 20 --max-diameter 60 --overlay found.png
  zeropose find --image car.png --kind edge --window 300,200,120,80 --direction 0 --direction-tolerance 20 --json
Exit status: 0 done, 1 nothing found (with the reason), 2 wrong usage or unreadable input.)";

}  // namespace zeropose::cli
