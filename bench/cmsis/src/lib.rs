//! Product and transpose of matrices by CMSIS-DSP (`arm_mat_mult_f32`, `arm_mat_trans_f32`).

#![no_std]

use core::ffi::c_int;

/// A matrix by rows.
pub type Matrix<const ROWS: usize, const COLUMNS: usize> = [[f32; COLUMNS]; ROWS];

/// `arm_matrix_instance_f32`.
#[repr(C)]
struct Instance {
    rows: u16,
    columns: u16,
    data: *mut f32,
}

unsafe extern "C" {
    fn arm_mat_mult_f32(a: *const Instance, b: *const Instance, product: *mut Instance) -> c_int;
    fn arm_mat_trans_f32(a: *const Instance, transpose: *mut Instance) -> c_int;
}

/// The result of a success.
const SUCCESS: c_int = 0;

/// Writes A B.
#[inline]
pub fn multiply<const I: usize, const J: usize, const K: usize>(
    a: &Matrix<I, J>,
    b: &Matrix<J, K>,
    product: &mut Matrix<I, K>,
) {
    let (a, b, mut product) = (read(a), read(b), written(product));
    // SAFETY: the function reads I × J and J × K numbers, and writes I × K.
    let status = unsafe { arm_mat_mult_f32(&raw const a, &raw const b, &raw mut product) };
    assert!(status == SUCCESS);
}

/// Writes Aᵀ.
#[inline]
pub fn transpose<const I: usize, const J: usize>(a: &Matrix<I, J>, transposed: &mut Matrix<J, I>) {
    let (a, mut transposed) = (read(a), written(transposed));
    // SAFETY: the function reads I × J numbers, and writes J × I.
    let status = unsafe { arm_mat_trans_f32(&raw const a, &raw mut transposed) };
    assert!(status == SUCCESS);
}

/// A matrix that the functions only read.
fn read<const I: usize, const J: usize>(matrix: &Matrix<I, J>) -> Instance {
    instance::<I, J>(matrix.as_ptr().cast::<f32>().cast_mut())
}

fn written<const I: usize, const J: usize>(matrix: &mut Matrix<I, J>) -> Instance {
    instance::<I, J>(matrix.as_mut_ptr().cast())
}

fn instance<const I: usize, const J: usize>(data: *mut f32) -> Instance {
    let [rows, columns] = const { [size(I), size(J)] };
    Instance { rows, columns, data }
}

#[expect(clippy::cast_possible_truncation, reason = "it fits: asserted")]
const fn size(of: usize) -> u16 {
    assert!(of <= u16::MAX as usize);
    of as u16
}
