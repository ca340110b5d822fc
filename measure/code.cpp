#include "measure/code.h"

#include <algorithm>
#include <array>

namespace zeropose {
namespace {

constexpr std::array table{
    CodeText{Code::ok, "ok", "The result is valid.", "Nothing to do."},

    CodeText{Code::unknown_command, "unknown_command", "The robot sent a command number that does not exist.",
             "Compare the robot program with the table of commands; check that it writes the whole block at "
             "once."},
    CodeText{Code::unknown_job, "unknown_job", "The robot asked for a job that the cell file does not have.",
             "Compare the job number in the robot program with the jobs in the cell file."},
    CodeText{
        Code::not_ready, "not_ready", "A command came while the cell was not ready for it.",
        "Look at the state: is a camera missing, no job selected, no zero measured? The robot must wait for "
        "ready."},
    CodeText{
        Code::zero_guard_wrong, "zero_guard_wrong",
        "A zero measurement was asked for without its guard word, so it was not made.",
        "If a new zero is wanted, send the guard 0x5A45524F as the argument; if not, find out who sent it."},
    CodeText{Code::halted, "halted", "An operator halted the cell.",
             "Resume it on the screen or by the command."},
    CodeText{
        Code::argument_out_of_range, "argument_out_of_range",
        "A command carried an argument outside its range.",
        "Check the argument in the robot program, above all its unit and its sign; before AtPosition, write "
        "the position block with the same index."},
    CodeText{
        Code::no_procedure, "no_procedure",
        "A robot told its position, but no calibration waits for it; or it asked for a zero measurement that "
        "its job does not need.",
        "Start the calibration first, then the robot program that goes through the positions. A job that "
        "evens gaps has no zero."},
    CodeText{Code::wrong_position, "wrong_position",
             "The robot's hand is not where the job's position was taught, or it is another robot's.",
             "Compare the position in the robot program with the cell file: index, pose, and the frame it is "
             "told in."},
    CodeText{Code::position_missing, "position_missing",
             "The camera on the robot's hand has not looked at this part from all positions of the job.",
             "Let the robot tell every position by AtPosition, with the part's id, before Measure or Zero; "
             "each picture counts once."},
    CodeText{
        Code::not_standing_still, "not_standing_still",
        "What a camera looks at moved between two pictures of one position.",
        "Let the robot wait until it has settled before it tells its position; look for play and vibration."},

    CodeText{Code::camera_missing, "camera_missing", "A camera of the job does not answer.",
             "Check its power, its network cable and the switch; the camera's name is in the reason."},
    CodeText{
        Code::frame_timeout, "frame_timeout", "A camera delivered no frame in time after the trigger.",
        "Check the trigger and the exposure time; if it happens now and then, check the network for load."},
    CodeText{Code::frame_damaged, "frame_damaged", "A frame arrived with parts missing.",
             "Check cable, plug and switch of this camera; look for dropped packets on the network card."},
    CodeText{Code::frame_wrong_size, "frame_wrong_size",
             "A frame has another size than the camera was calibrated with.",
             "Somebody changed the camera's region or binning, or cameras were exchanged: put it back, or "
             "calibrate "
             "again."},
    CodeText{
        Code::result_timeout, "result_timeout", "The result was not ready at the deadline.",
        "Compare the times in the log with the deadline in the cell file; look for load on the computer."},
    CodeText{
        Code::frame_frozen, "frame_frozen",
        "A camera delivered the same picture as before, bit for bit: it does not show what is there now.",
        "Switch the camera off and on again; if it comes back, update its firmware or exchange it."},
    CodeText{Code::image_saturated, "image_saturated",
             "A large part of a picture is white, or so many marks are that too few are left.",
             "Look for sunlight or a reflection; shorten the exposure time or close the iris."},
    CodeText{Code::image_dark, "image_dark", "A picture is almost black.",
             "Check the lamp, the lens cap and whether something stands in front of the camera."},
    CodeText{
        Code::image_blurred, "image_blurred", "Marks in a picture are so blurred that too few are left.",
        "Focus the lens, clean it, check that it is screwed tight; did the object still move, or does the "
        "camera shake? Then wait longer, or shorten the exposure time."},

    CodeText{Code::too_few_marks, "too_few_marks", "Fewer marks were found than the job requires.",
             "Look at the pictures: is the object there, are marks covered, dirty or badly lit? Which ones "
             "is in the "
             "reason."},
    CodeText{Code::too_few_marks_in_camera, "too_few_marks_in_camera",
             "One camera found fewer marks than the job requires of each.",
             "Look at this camera's picture: covered or dirty marks, light, camera knocked out of place."},
    CodeText{
        Code::too_few_cameras, "too_few_cameras", "Fewer cameras than the job requires saw a usable mark.",
        "Look at the pictures of the cameras that are named; check their light and whether they were moved."},
    CodeText{
        Code::marks_invalid, "marks_invalid",
        "The marks or what was found of them hold numbers that cannot be used.",
        "Check the job in the cell file with check-config; if it is fine, keep the record and report it."},
    CodeText{
        Code::lines_not_found, "lines_not_found",
        "The projector's lines on the tyre, or the tyre's profile along them, were not all found.",
        "Look at the pictures, the reason names the camera and the line: is the tyre clean, of the type of "
        "the job and in its place? Do all projectors draw all their lines? Are lenses and projectors "
        "clean?"},

    CodeText{
        Code::geometry_degenerate, "geometry_degenerate",
        "The marks that were found do not fix the object's position, for example because they lie on a line.",
        "Free the marks that are missing, or give the job more marks away from that line."},
    CodeText{Code::not_converged, "not_converged",
             "No position of the object explains the marks that were found.",
             "Look at the pictures: is it the right object, and do the marks drawn in sit on the real ones?"},
    CodeText{
        Code::deviation_not_attributable, "deviation_not_attributable",
        "The marks contradict each other and there are too few to tell which one is wrong.",
        "Look at the marks with the largest deviations: is one covered in part, mistaken for another, or the "
        "object bent? Was a camera moved?"},
    CodeText{Code::sigma_too_large, "sigma_too_large",
             "The result would be less certain than the job allows at an application point.",
             "Marks are missing or badly seen: look at the pictures; or the job has too few marks near that "
             "point."},

    CodeText{
        Code::hidden_error_too_large, "hidden_error_too_large",
        "Too few marks check each other: one wrong mark could move the result further than the job allows "
        "without being noticed.",
        "Marks are missing: look at the pictures; or the job has too few marks far from each other: "
        "zeropose plan shows which ones nothing checks."},

    CodeText{Code::limit_x, "limit_x", "The object is shifted further along x than the limit allows.",
             "Check how the object stands; change the limit only if the robot can really go there."},
    CodeText{Code::limit_y, "limit_y", "The object is shifted further along y than the limit allows.",
             "Check how the object stands; change the limit only if the robot can really go there."},
    CodeText{Code::limit_z, "limit_z", "The object is shifted further along z than the limit allows.",
             "Check how the object stands; change the limit only if the robot can really go there."},
    CodeText{Code::limit_rx, "limit_rx", "The object is turned further about x than the limit allows.",
             "Check how the object stands; change the limit only if the robot can really go there."},
    CodeText{Code::limit_ry, "limit_ry", "The object is turned further about y than the limit allows.",
             "Check how the object stands; change the limit only if the robot can really go there."},
    CodeText{Code::limit_rz, "limit_rz", "The object is turned further about z than the limit allows.",
             "Check how the object stands; change the limit only if the robot can really go there."},
    CodeText{Code::value_out_of_range, "value_out_of_range",
             "A value of the correction does not fit into the robot's number format.",
             "Check the frame and the robot's pose in the cell file: the correction is implausibly large."},
    CodeText{Code::limit_displacement, "limit_displacement",
             "The object, or an application point of it, is displaced further than the job allows.",
             "Check how the object stands; the reason says more. Change the limit only if the robot can "
             "really go there."},
    CodeText{
        Code::step_too_large, "step_too_large",
        "The object stands further from where the last valid result put it than the job allows.",
        "Check how the object stands and whether it is the right one. If the jump is wanted, let the robot "
        "send Reset, select another job or take a new zero: the next result is then not compared. "
        "Acknowledge alone does not do it."},
    CodeText{
        Code::gaps_not_even, "gaps_not_even",
        "The pane stands as evenly as it can, and its gaps are still not within the tolerance.",
        "Look at the gaps in the pictures: does this pane fit this frame, does it sit right in the gripper? "
        "Change the tolerance only if such a gap may leave the plant."},

    CodeText{
        Code::camera_moved, "camera_moved", "A camera is not where it was at the zero measurement.",
        "Look at the camera and its holder: put it back, or find its new pose with zeropose recalibrate, "
        "put that into the calibration file and take a new zero."},
    CodeText{
        Code::reference_missing, "reference_missing",
        "A camera sees too few of its reference points to tell whether it was moved.",
        "Free, clean or light the reference points that are named; look whether the camera was turned away."},
    CodeText{Code::camera_suspicious, "camera_suspicious",
             "The reference points of a camera drift, and the cell file says that this blocks.",
             "Look at the camera, its holder and the reference points; take a new zero when all is firm."},

    CodeText{Code::zero_missing, "zero_missing", "No zero measurement exists for this job.",
             "Put the object into its ideal position and make the zero measurement."},
    CodeText{Code::zero_outdated, "zero_outdated",
             "The zero measurement belongs to another calibration or another job file.",
             "Make a new zero measurement, or put the files back that it was made with."},
    CodeText{
        Code::storage_failed, "storage_failed",
        "The zero measurement could not be stored, or not be read again.",
        "Check the disk: is it full, read-only or broken? The reason names the file. If that is damaged, "
        "make a new zero measurement."},
    CodeText{Code::compensation_too_large, "compensation_too_large",
             "At the zero measurement a mark was found too far from where it should be.",
             "Look at this mark in the picture: is it really the mark? Then check its coordinates in the "
             "cell file."},

    CodeText{Code::internal, "internal", "The program came to a place where it must not come.",
             "Measure again; if it comes back, restart the service, keep the record and report it."},
};

}  // namespace

std::span<const CodeText> code_table() { return table; }

const CodeText& text_of(Code code) {
  const auto* const found =
      std::find_if(table.begin(), table.end(), [code](const CodeText& text) { return text.code == code; });
  return found == table.end() ? table.back() : *found;
}

}  // namespace zeropose
