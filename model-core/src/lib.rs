//! The laws of a servo-pneumatic axis.
#![no_std]
